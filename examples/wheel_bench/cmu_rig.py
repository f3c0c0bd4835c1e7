"""The smooth wheel of Carnegie Mellon University: radius 58 mm, width 50 mm."""

from rig import rig

from rille.cad import Mechanism


def build() -> Mechanism:
    """Smooth wheel on a carriage."""
    return rig(58.0, 50.0)
