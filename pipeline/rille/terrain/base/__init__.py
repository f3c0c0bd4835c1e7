"""The ground before landforms: flat, plane, fractal, or a measured DEM with or without detail below its resolution."""

from rille.terrain.base.ground import Base, Ground
from rille.terrain.base.make import make_base
from rille.terrain.base.sheet import BaseSheet, DetailSheet

__all__ = ["Base", "BaseSheet", "DetailSheet", "Ground", "make_base"]
