"""Numbers, names and files of exported models."""

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, MassProperties

NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 cannot hold."""

UNBOUNDED = 1e16
"""No limit, where URDF must have one: what SDF before 1.9 took for infinite. [rad, m and per second]"""


def number(value: float, what: str = "a value of the model") -> str:
    """Shortest decimal that reads back as the same double (17 significant digits at most).

    Raises
    ------
    InputRefused : if it is not finite.
    """
    if not math.isfinite(value):
        raise InputRefused(f"{what} is {value}; other programs take finite values only, correct it and build the model again")
    return repr(float(value) + 0.0)  # + 0.0: no negative zero


def numbers(values: Iterable[float], what: str = "a value of the model") -> str:
    """Several numbers, with spaces between them."""
    return " ".join(number(float(value), what) for value in values)


def euler(rotation: NDArray[np.float64]) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] of R = Rz(yaw) Ry(pitch) Rx(roll), the convention of URDF and SDF.

    Each angle is taken from what the ones before leave of R, so that the product gives R back to rounding at pitch = 90 deg, too,
    where roll and yaw are not determined one by one.
    """
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    c, s = math.cos(yaw), math.sin(yaw)
    rest = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ rotation
    pitch = math.atan2(-rest[2, 0], rest[0, 0])
    roll = math.atan2(-rest[1, 2], rest[1, 1])
    return roll, pitch, yaw


def principal_moments(properties: MassProperties) -> NDArray[np.float64]:
    """Principal moments of inertia [kg m^2], ascending, shape (3,)."""
    return np.asarray(np.linalg.eigvalsh(properties.inertia), dtype=float)


class Names:
    """Names of one namespace of an exported file: unique, without characters that XML cannot hold."""

    def __init__(self, reserved: Iterable[str] = ()) -> None:
        self._taken = set(reserved)

    def take(self, wanted: str, kind: str = "") -> str:
        """The name itself if it is free, else with ``_kind`` and a number behind it."""
        clean = NOT_XML.sub("_", wanted)
        candidate, count = clean, 1
        while candidate in self._taken:
            stem = f"{clean}_{kind}" if kind else clean
            candidate = stem if kind and count == 1 else f"{stem}_{count + (not kind)}"
            count += 1
        self._taken.add(candidate)
        return candidate


class FileNames:
    """File names that every file system takes: ASCII letters, digits, ``._-``; unique without regard to case."""

    def __init__(self) -> None:
        self._names = Names()

    def take(self, wanted: str, suffix: str) -> str:
        """A file name for whatever is called ``wanted``."""
        stem = re.sub(r"[^A-Za-z0-9._-]+", "_", wanted).strip("._-")[:80] or "mesh"
        return self._names.take(stem.lower()) + suffix


def save(root: ET.Element, path: Path) -> None:
    """Write an XML tree, indented, in UTF-8.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    ET.indent(root)
    with writable(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


class writable:  # noqa: N801 - reads as a statement
    """Turns failures of writing into a sentence."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        if isinstance(error, OSError):
            raise InputRefused(f"'{self._path}' cannot be written: {error.strerror or error}; choose another place") from None
