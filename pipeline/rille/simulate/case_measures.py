"""A drive in numbers that can be compared over a thousand drives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rille.model.machine import Machine
from rille.model.over_time import shares, slipping
from rille.model.study import ChannelMeasure, Measure
from rille.simulate.tip_over import Corners, Support, support_corners

Array = NDArray[np.float64]
WHEEL = ("wheel.slip_ratio", "wheel.sinkage", "wheel.drawbar_pull", "wheel.drive_torque")


class Channel(NamedTuple):
    """As ``rille._solver`` reads it."""

    quantity: str
    target: str
    component: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Driven:
    """What is read of a machine. root : body that no joint carries, '' if held. wheels : (name, joint, radius [m]). drives : (name, joint).

    corners : wheels that it stands on; None: it cannot tip. bodies : all names. channels : all that is read.
    """

    root: str
    wheels: tuple[tuple[str, str, float], ...]
    drives: tuple[tuple[str, str], ...]
    corners: Corners | None
    bodies: tuple[str, ...]
    channels: tuple[Channel, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Drove:
    """A drive as it was read.

    time : (n,) [s]. values : (n,) by channel. work : of all drives [J]. time_reached : [s]. support : None where there is none.
    """

    time: Array
    values: Mapping[Channel, Array]
    work: float
    time_reached: float
    support: Support | None = None


def driven_of(machine: Machine, asked: Sequence[Channel]) -> Driven:
    """What must be read of a machine for the usual outcomes and those asked."""
    wheels = tuple((w.name, w.joint, w.radius) for w in machine.wheels)
    drives = tuple((d.name, d.joint) for d in machine.drives)
    corners = support_corners(machine) if machine.root else None
    bodies = tuple(body.name for body in machine.bodies)
    channels = [Channel(quantity, name, 0) for name, _, _ in wheels for quantity in WHEEL]
    channels += [Channel("joint.velocity", joint, 0) for _, joint, _ in wheels]
    channels += [Channel("joint.effort", joint, 0) for _, joint in drives]
    posed = [machine.root] if machine.root else []
    posed += bodies if corners is not None else ()
    for body in dict.fromkeys(posed):
        channels += [Channel("part.position", body, k) for k in range(3)] + [Channel("part.orientation", body, k) for k in range(4)]
    if machine.root:
        channels += [Channel("part.linear_velocity", machine.root, k) for k in range(3)]
    every = tuple(dict.fromkeys([*channels, *asked]))
    return Driven(root=machine.root, wheels=wheels, drives=drives, corners=corners, bodies=bodies, channels=every)


def measures_of(driven: Driven) -> tuple[Measure, ...]:
    """The usual outcomes of such a machine; the main ones first."""
    found = [Measure(name="time_reached", unit="s", meaning="simulated time")]
    if driven.root:
        found += [
            Measure(name="distance", unit="m", meaning="length of the path", main=True),
            Measure(name="distance_made_good", unit="m", meaning="straight from start to end, in plan"),
            Measure(name="final_x", unit="m", meaning="where it ended"),
            Measure(name="final_y", unit="m", meaning="where it ended"),
            Measure(name="final_z", unit="m", meaning="where it ended"),
            Measure(name="final_heading", unit="rad", meaning="where it headed at the end, whole turns counted"),
            Measure(name="max_tilt", unit="rad", meaning="largest angle of the body against the vertical", main=not driven.wheels),
        ]
    if driven.corners is not None:
        meaning = "smallest angle from the weight's line to an edge of the wheels' support; below 0 it tips"
        found.append(Measure(name="min_stability_angle", unit="rad", meaning=meaning, main=True))
    if driven.drives:
        found += [
            Measure(name="energy", unit="J", meaning="work of all drives", main=True),
            Measure(name="mean_power", unit="W", meaning="work of all drives over time"),
            Measure(name="peak_torque", unit="N m", meaning="largest effort of a drive", main=not driven.wheels),
        ]
        found += [Measure(name=f"peak_torque.{name}", unit="N m", meaning=f"largest effort of {name}") for name, _ in driven.drives]
        if driven.root:
            found.append(Measure(name="energy_per_metre", unit="J/m", meaning="work of all drives per length of the path"))
    if driven.wheels:
        found += [
            Measure(name="mean_slip_ratio", unit="-", meaning="over wheels and times at which they moved, signed", main=True),
            Measure(name="max_slip_ratio", unit="-", meaning="largest of all wheels, in size"),
            Measure(name="max_sinkage", unit="m", meaning="deepest of all wheels", main=True),
            Measure(name="mean_drawbar_pull", unit="N", meaning="sum over the wheels, over time", main=True),
        ]
        for name, _, _ in driven.wheels:
            found += [
                Measure(name=f"mean_slip_ratio.{name}", unit="-", meaning=f"of {name} while it moved, signed"),
                Measure(name=f"max_slip_ratio.{name}", unit="-", meaning=f"largest of {name}, in size"),
                Measure(name=f"max_sinkage.{name}", unit="m", meaning=f"deepest of {name}"),
                Measure(name=f"mean_drawbar_pull.{name}", unit="N", meaning=f"of {name}, over time"),
            ]
    return tuple(found)


def measured(driven: Driven, drove: Drove, asked: Sequence[ChannelMeasure]) -> dict[str, float]:
    """Outcomes by name; what has no value (slip of a wheel that never moved) is left out."""
    found = {"time_reached": drove.time_reached}
    if len(drove.time) == 0:
        return found
    if driven.root:
        found |= _of_root(driven, drove)
    if driven.drives:
        found |= _of_drives(driven, drove, found.get("distance", 0.0))
    if driven.wheels:
        found |= _of_wheels(driven, drove)
    for one in asked:
        later = drove.time >= one.after
        if later.any():
            values = drove.values[Channel(one.quantity, one.target, one.component)][later]
            found[one.name] = _reduced(drove.time[later], values, one.reduce)
    return found


def _reduced(time: Array, values: Array, how: str) -> float:
    if how == "final":
        return float(values[-1])
    if how == "rms":
        return float(np.sqrt(np.average(values**2, weights=shares(time))))
    if how == "mean":
        return float(np.average(values, weights=shares(time)))
    return float(values.max() if how == "max" else values.min())


def _vector(drove: Drove, quantity: str, body: str, size: int) -> Array:
    return np.stack([drove.values[Channel(quantity, body, k)] for k in range(size)], axis=1)


def _of_root(driven: Driven, drove: Drove) -> dict[str, float]:
    place = _vector(drove, "part.position", driven.root, 3)
    w, x, y, z = _vector(drove, "part.orientation", driven.root, 4).T
    tilt = np.arccos(np.clip(1 - 2 * (x**2 + y**2), -1, 1))
    heading = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y**2 + z**2)))
    found = {
        "distance": float(np.linalg.norm(np.diff(place, axis=0), axis=1).sum()),
        "distance_made_good": float(np.hypot(*(place[-1] - place[0])[:2])),
        **{f"final_{axis}": float(place[-1, k]) for k, axis in enumerate("xyz")},
        "final_heading": float(heading[-1]),
        "max_tilt": float(tilt.max()),
    }
    if drove.support is not None:
        poses = {b: (_vector(drove, "part.position", b, 3), _vector(drove, "part.orientation", b, 4)) for b in driven.bodies}
        found["min_stability_angle"] = float(drove.support.angles(poses).min())
    return found


def _of_drives(driven: Driven, drove: Drove, distance: float) -> dict[str, float]:
    peaks = {name: float(np.abs(drove.values[Channel("joint.effort", joint, 0)]).max()) for name, joint in driven.drives}
    found = {"energy": drove.work, "peak_torque": max(peaks.values()), **{f"peak_torque.{name}": peak for name, peak in peaks.items()}}
    if drove.time_reached > 0:
        found["mean_power"] = drove.work / drove.time_reached
    if distance > 0.01:
        found["energy_per_metre"] = drove.work / distance
    return found


def _of_wheels(driven: Driven, drove: Drove) -> dict[str, float]:
    speed = np.zeros(len(drove.time))
    if driven.root:
        speed = np.linalg.norm(_vector(drove, "part.linear_velocity", driven.root, 3), axis=1)
    lasts = shares(drove.time)
    found: dict[str, float] = {}
    slips, weights, pulls = [], [], []
    for name, joint, radius in driven.wheels:
        slip, sinkage, pull, _ = (drove.values[Channel(quantity, name, 0)] for quantity in WHEEL)
        moving = slipping(speed, radius * drove.values[Channel("joint.velocity", joint, 0)], sinkage)
        slips.append(slip[moving])
        weights.append(lasts[moving])
        pulls.append(float(np.average(pull, weights=lasts)))
        if moving.any():
            found |= _of_slip(slips[-1], weights[-1], f".{name}")
        found[f"max_sinkage.{name}"] = float(sinkage.max())
        found[f"mean_drawbar_pull.{name}"] = pulls[-1]
    all_slips = np.concatenate(slips)
    if len(all_slips):
        found |= _of_slip(all_slips, np.concatenate(weights), "")
    found["max_sinkage"] = max(found[f"max_sinkage.{name}"] for name, _, _ in driven.wheels)
    found["mean_drawbar_pull"] = float(sum(pulls))
    return found


def _of_slip(slip: Array, shares: Array, of: str) -> dict[str, float]:
    return {f"mean_slip_ratio{of}": float(np.average(slip, weights=shares)), f"max_slip_ratio{of}": float(np.abs(slip).max())}
