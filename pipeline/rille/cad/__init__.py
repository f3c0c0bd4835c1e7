"""From a STEP assembly and a sheet to a checked mechanism.

CadQuery and OCCT take seconds to import, so nothing here imports them before it is called.
"""

from rille.cad.build import build
from rille.cad.geometry import VolumeProperties, brep_hash, tessellate, volume_properties
from rille.cad.step_reader import Assembly, PlacedPart, Prototype, read_document, read_step

__all__ = [
    "Assembly",
    "PlacedPart",
    "Prototype",
    "VolumeProperties",
    "brep_hash",
    "build",
    "read_document",
    "read_step",
    "tessellate",
    "volume_properties",
]
