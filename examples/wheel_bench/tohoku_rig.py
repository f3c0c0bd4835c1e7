"""The wheel with fins of Tohoku University (2003): radius 90 mm, width 100 mm, fins of 10 mm. Their number is not published; 16 is ours."""

from rig import rig

from rille.cad import Mechanism


def build() -> Mechanism:
    """Wheel with fins on a carriage."""
    return rig(90.0, 100.0, fins=16, fin_height=10.0)
