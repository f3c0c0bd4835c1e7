"""From a STEP assembly and a sheet to a checked mechanism.

CadQuery and OCCT take seconds to import, so nothing here imports them before it is called.
"""

from rille.cad.build import build
from rille.cad.files.assembly import Assembly, PlacedPart, Prototype
from rille.cad.files.reading import load_assembly, mesh_of, meshes_of
from rille.cad.files.step_reader import read_document, read_step
from rille.cad.geometry import VolumeProperties, brep_hash, tessellate, volume_properties
from rille.cad.script import Mechanism

__all__ = [
    "Assembly",
    "Mechanism",
    "PlacedPart",
    "Prototype",
    "VolumeProperties",
    "brep_hash",
    "build",
    "load_assembly",
    "mesh_of",
    "meshes_of",
    "read_document",
    "read_step",
    "tessellate",
    "volume_properties",
]
