"""Two sides declared once: what is named after one side of the machine exists on the other, too."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.cad.sheet import MirrorSheet, RoverSheet
from rille.model import InputRefused
from rille.model.quantity import to_si

_FOREIGN = {"place": {"file", "database", "part"}}  # keys whose texts name no thing of the sheet
_TABLES = ("place", "mass", "frame", "body", "joint", "drive", "differential", "gear", "loop", "wheel", "sensor")


def other_side(name: str, mirror: MirrorSheet) -> str:
    """The name with the word of one side replaced by that of the other."""
    return name.replace(mirror.of, mirror.to)


def mirrored(page: RoverSheet) -> tuple[RoverSheet, dict[str, dict[str, str]]]:
    """The sheet with both sides written out, and by table the original of every row that was made.

    Points and centres are reflected. Positions of joints keep their meaning: hinges turn like mirror images (an axis is a pseudovector:
    n' = -S n), prismatic joints slide like them (n' = S n); where this axis would point away from the original's, it is turned round
    and the limits are exchanged, so that the axes of twins point the same way. A gear's ratio changes its sign where that is done to one
    of its joints and not to the other.

    Raises
    ------
    InputRefused : for a hinge or slide without a stated axis that is mirrored, or that a mirrored gear takes along.
    """
    if page.mirror is None:
        return page, {table: {} for table in _TABLES}
    mirror = page.mirror
    k = "xyz".index(mirror.normal)
    offset = to_si(mirror.offset, "length", "offset of [mirror]")
    twins: dict[str, dict[str, str]] = {table: {} for table in _TABLES}
    tables: dict[str, list[dict[str, Any]]] = {}
    for table in _TABLES:
        rows = [row.model_dump(exclude_none=True) for row in getattr(page, table)]
        taken = {_name(row) for row in rows}
        made = []
        for row in rows:
            name = other_side(_name(row), mirror)
            if name == _name(row) or name in taken:
                continue
            twin = {key: v if key in _FOREIGN.get(table, ()) else _renamed(v, mirror) for key, v in row.items()}
            _reflect(table, twin, k, offset)
            made.append(twin)
            twins[table][name] = _name(row)
        tables[table] = [*rows, *made]
    _turn_ratios(tables, twins["gear"], k)
    rest = page.model_dump(exclude_none=True, exclude=set(_TABLES))
    return RoverSheet.model_validate(rest | tables), twins


def reflected(points: NDArray[np.float64], k: int, offset: float) -> NDArray[np.float64]:
    """Mirror image of points (..., 3) in the plane x_k = offset."""
    image = np.array(points, float)
    image[..., k] = 2 * offset - image[..., k]
    return image


def _name(row: dict[str, Any]) -> str:
    return row.get("name") or row["joint"]


def _renamed(value: Any, mirror: MirrorSheet) -> Any:
    if isinstance(value, str):
        return other_side(value, mirror)
    if isinstance(value, list):
        return [_renamed(v, mirror) for v in value]
    if isinstance(value, dict):
        return {key: _renamed(v, mirror) for key, v in value.items()}
    return value


def _reflect(table: str, row: dict[str, Any], k: int, offset: float) -> None:
    name = _name(row)
    own_frame = table == "frame" and "part" in row  # coordinates of a part are reflected with the part itself, through its origin
    center = 0.0 if own_frame else offset

    def point(key: str, place: dict[str, Any] = row) -> None:
        if key in place:
            values = np.array([to_si(v, "length", f"{key} of '{name}'") for v in place[key]])
            place[key] = reflected(values, k, center).tolist()

    for key in ("point", "at", "center", "position", "com"):
        if not isinstance(row.get(key), str):
            point(key)
    if "cylinder" in row:
        point("near", row["cylinder"])
    if "inertia" in row:
        _flip_products(row["inertia"], k, name)
    if "rpy" in row:
        angles = [to_si(v, "angle", f"rpy of '{name}'") for v in row["rpy"]]
        row["rpy"] = [a if i == k else -a for i, a in enumerate(angles)]  # S R S: turns about the normal keep, others change their sense
    if table == "joint" and row["kind"] in ("hinge", "prismatic") and "axis" not in row:
        raise InputRefused(
            f"joint '{name}' on a mirrored sheet has no `axis`; give it beside `at`, so that it is clear which way is positive"
        )
    if "axis" in row:
        axis = np.array([to_si(v, "dimensionless", f"axis of '{name}'") for v in row["axis"]])
        row["axis"] = reflected(axis, k, 0.0).tolist() if table == "frame" else _twin_axis(axis, k, row).tolist()


def _turn_ratios(tables: dict[str, list[dict[str, Any]]], twins: dict[str, str], k: int) -> None:
    """Gears of twins, q_b = ratio q_a: the mirror image of a motion is counted backwards by joints whose sense is -1."""
    joints = {row["name"]: row for row in tables["joint"]}
    gears = {row["name"]: row for row in tables["gear"]}
    for name, original in twins.items():
        row, first = gears[name], gears[original]
        senses = [_sense(joints.get(first[key]), joints.get(row[key]), k, name) for key in ("joint_a", "joint_b")]
        if senses[0] != senses[1]:
            row["ratio"] = -to_si(row["ratio"], "dimensionless", f"ratio of gear '{name}'")


def _sense(joint: dict[str, Any] | None, twin: dict[str, Any] | None, k: int, gear: str) -> int:
    """+1 if the twin's position is the joint's in the mirror image of a motion, -1 if it is less that. joint, twin : may be one."""
    if joint is None or twin is None:
        return 1  # refused when the gear is made
    axes = []
    for row in (joint, twin):
        if "axis" not in row:
            raise InputRefused(
                f"gear '{gear}' of the mirrored side takes joint '{row['name']}' along, which has no `axis`; give it beside `at`"
            )
        axes.append(np.array([to_si(v, "dimensionless", f"axis of '{row['name']}'") for v in row["axis"]]))
    return 1 if _image_of_axis(axes[0], k, joint["kind"]) @ axes[1] >= 0 else -1


def _image_of_axis(axis: NDArray[np.float64], k: int, kind: str) -> NDArray[np.float64]:
    return reflected(axis, k, 0.0) * (1 if kind == "prismatic" else -1)


def _twin_axis(axis: NDArray[np.float64], k: int, row: dict[str, Any]) -> NDArray[np.float64]:
    image = _image_of_axis(axis, k, row["kind"])
    if image @ axis >= 0:
        return image
    low, high = row.pop("upper", None), row.pop("lower", None)
    kind = "length" if row["kind"] == "prismatic" else "angle"
    row.update({key: -to_si(v, kind, f"limit of '{_name(row)}'") for key, v in (("lower", low), ("upper", high)) if v is not None})
    return -image


def _flip_products(inertia: list[Any], k: int, name: str) -> None:
    for i, pair in ((3, (0, 1)), (4, (0, 2)), (5, (1, 2))):
        if k in pair:
            inertia[i] = -to_si(inertia[i], "inertia", f"inertia of '{name}'")
