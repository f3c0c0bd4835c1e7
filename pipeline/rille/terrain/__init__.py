"""Terrain: measured and synthetic ground, landforms placed on it, soils."""

from rille.terrain.delivery.ruts import require_geotiff, write_ruts
from rille.terrain.dem import Dem, height_at, read_dem
from rille.terrain.landform import Driver, Landform
from rille.terrain.register import landforms, soils
from rille.terrain.scene import build

__all__ = ["Dem", "Driver", "Landform", "build", "height_at", "landforms", "read_dem", "require_geotiff", "soils", "write_ruts"]
