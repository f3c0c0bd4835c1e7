"""Mechanisms for other programs, and from them: URDF, MJCF, SDF and plain meshes.

Heavy packages are imported inside the functions that need them.
"""

from rille.cad.exchange.meshes import write_scene
from rille.cad.exchange.mjcf import write_mjcf
from rille.cad.exchange.sdf import write_sdf
from rille.cad.exchange.urdf import write_urdf
from rille.cad.exchange.urdf_in import read_urdf

__all__ = ["read_urdf", "write_mjcf", "write_scene", "write_sdf", "write_urdf"]
