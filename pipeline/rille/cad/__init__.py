"""From a STEP assembly and a sheet to a checked mechanism.

CadQuery and OCCT take seconds to import, so nothing here imports them before it is called.
"""

from rille.cad.build import build
from rille.cad.step_reader import Assembly, PlacedPart, Prototype, read_step

__all__ = ["Assembly", "PlacedPart", "Prototype", "build", "read_step"]
