"""Units as headers of tables write them, which are not always as pint knows them."""

import math

from rille.model.quantity import is_unit

TURN = math.pi / 180
STANDARD_GRAVITY = 9.80665  # [m/s^2]
SPELT = {  # SI unit: ending of a name -> factor to SI
    "rad": {
        "deg": TURN,
        "°": TURN,
        "degree": TURN,
        "degrees": TURN,
        "rad": 1.0,
        "radians": 1.0,
        "mrad": 1e-3,
        "rev": 2 * math.pi,
        "turns": 2 * math.pi,
    },
    "rad/s": {
        "rpm": math.pi / 30,
        "degps": TURN,
        "dps": TURN,
        "deg/s": TURN,
        "°/s": TURN,
        "deg_s": TURN,
        "radps": 1.0,
        "rad/s": 1.0,
        "rad_s": 1.0,
        "rps": 2 * math.pi,
    },
    "m": {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "km": 1e3, "um": 1e-6},
    "m/s": {
        "mps": 1.0,
        "m/s": 1.0,
        "m_s": 1.0,
        "mmps": 1e-3,
        "mm/s": 1e-3,
        "mm_s": 1e-3,
        "cm/s": 1e-2,
        "cm_s": 1e-2,
        "kmh": 1 / 3.6,
        "km/h": 1 / 3.6,
        "kph": 1 / 3.6,
    },
    "m/s^2": {"g": STANDARD_GRAVITY, "mg": STANDARD_GRAVITY / 1000, "mps2": 1.0, "m/s2": 1.0, "m/s^2": 1.0, "m/s²": 1.0, "m_s2": 1.0},
    "N": {"n": 1.0, "kn": 1e3, "kgf": STANDARD_GRAVITY},
    "N m": {"nm": 1.0, "n_m": 1.0, "mnm": 1e-3, "ncm": 1e-2},
    "A": {"a": 1.0, "ma": 1e-3},
    "V": {"v": 1.0, "mv": 1e-3},
    "1": {"percent": 0.01, "pct": 0.01, "%": 0.01},
    "s": {
        "s": 1.0,
        "sec": 1.0,
        "secs": 1.0,
        "seconds": 1.0,
        "ms": 1e-3,
        "msec": 1e-3,
        "us": 1e-6,
        "usec": 1e-6,
        "ns": 1e-9,
        "nsec": 1e-9,
        "min": 60.0,
    },
}


def names_unit(text: str) -> bool:
    """Whether a text is a unit, as pint knows it or as headers write it: "deg/s", "m/s2", "Nm"."""
    return any(text.lower() in known for known in SPELT.values()) or is_unit(text)
