"""Does an accelerometer feel the gravity that it is under? What a body is held up by is, in the mean, its weight."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rille.model.quaternion import into_body, unit
from rille.model.recording import AXES, Channel, GateFinding
from rille.model.rover import Vector
from rille.model.unit_names import STANDARD_GRAVITY
from rille.recording.gate.source import Source
from rille.recording.gate.turning import SHORTEST, orientations, quaternions, wholes

Array = NDArray[np.float64]
NONE = 0.085  # of gravity, up to which it is not felt at all
NEAR = 0.1  # relative, by which what is felt may miss a value that has a meaning
TURNED = -0.7  # of gravity, from which on what is felt points down
MOST = 50_000  # samples that are looked at
FEWEST = 16
BRIEF = 0.5  # [s] over which jolts are averaged


def check_gravity(source: Source, k: int, gravity: Vector) -> list[GateFinding]:
    """Specific forces of a body along the vertical, in the mean, against ``gravity`` [m/s^2] in W: in g, without gravity, or turned round.

    The mean is that of gravity, but for the speed that is gained or lost meanwhile. Where the orientation was not recorded, the size of
    what is felt for a while is taken, and it is not told whether that is turned round.
    """
    size = float(np.linalg.norm(gravity))
    if size < 1e-3:
        return []
    used = source.recordings[k].channels
    found = []
    for trio in wholes(used, "part.linear_acceleration", AXES):
        felt, vertical = _felt(source, k, trio, used, np.asarray(gravity) / size)
        if felt is not None:
            found += _finding(trio, felt / size, size, vertical=vertical)
    return found


def _felt(source: Source, k: int, trio: Sequence[Channel], used: Sequence[Channel], down: Array) -> tuple[float | None, bool]:
    """Mean upward part of the specific force [m/s^2], and True; or its usual size, and False; None: too few samples."""
    time, force = _samples(source, k, [channel.name for channel in trio])
    if len(time) < FEWEST:
        return None, False
    if trio[0].frame == "world":
        return float(np.mean(force @ -down)), True
    for parts in orientations(used, trio[0].target):
        at, values = _samples(source, k, parts)
        turned = quaternions(values)
        whole = (at >= time[0]) & (at <= time[-1]) & (np.linalg.norm(turned, axis=1) > SHORTEST)
        if np.count_nonzero(whole) < FEWEST:
            continue
        up = into_body(unit(turned[whole]), np.tile(-down, (int(whole.sum()), 1)))
        there = np.stack([np.interp(at[whole], time, force[:, j]) for j in range(3)], axis=1)
        return float(np.mean(np.sum(there * up, axis=1))), True
    return _usual_size(time, force), False


def _usual_size(time: Array, force: Array) -> float:
    """Median of the size of means over ``BRIEF``; of the samples where these cancel each other, as in a body that spins."""
    block = np.unique(np.floor(time / BRIEF), return_inverse=True)[1]
    count = np.bincount(block)
    means = np.stack([np.bincount(block, weights=force[:, j]) for j in range(3)], axis=1) / count[:, None]
    brief = float(np.median(np.linalg.norm(means, axis=1)))
    single = float(np.median(np.linalg.norm(force, axis=1)))
    return brief if brief > 0.5 * single else single


def _samples(source: Source, k: int, names: Sequence[str]) -> tuple[Array, Array]:
    """Times (n,) and values (n, m) of channels of one clock, where all are there and time goes on."""
    read = []
    time = np.empty(0)
    for name in names:
        time, value = source.samples(k, name)
        stride = len(time) // MOST + 1
        time, value = time[::stride], value[::stride]
        read.append(value)
    values = np.stack(read, axis=1)
    good = np.isfinite(time) & np.isfinite(values).all(axis=1)
    time, values = time[good], values[good]
    order = np.argsort(time, kind="stable")
    return time[order], values[order]


def _finding(trio: Sequence[Channel], share: float, size: float, *, vertical: bool) -> list[GateFinding]:
    """share : of gravity, that is felt."""
    names = ", ".join(f"'{channel.name}'" for channel in trio)
    how = "upwards in the mean" if vertical else "as a rule"
    felt = f"{names} feel {share * size:.4g} m/s^2 {how}, and gravity is {size:.4g} m/s^2"
    known = abs(share) * STANDARD_GRAVITY
    if abs(known - 1) < NEAR:
        turned = " and turn the sign of their scale" if share < 0 else ""
        code, message = "unit", f'{felt}: they are in g; set unit = "g_0"{turned}'
    elif abs(share) < NONE:
        code = "gravity"
        message = (
            f"{felt}: gravity was taken off them, unless it falls all the time, and {trio[0].quantity} is what an accelerometer feels; "
            'record that, or set role = "ignore"'
        )
    elif vertical and share < TURNED:
        code, message = "sign", f"{felt}: they point along gravity, and what holds a body up points against it; turn the sign of all three"
    elif abs(share * size / STANDARD_GRAVITY - 1) < NEAR and abs(share - 1) > 3 * NEAR:
        code, message = "gravity", f"{felt}: they feel that of the Earth; is it that scenario?"
    else:
        return []
    detail: dict[str, object] = {"felt": share * size, "gravity": size, "vertical": vertical}
    severity = "warning" if code == "gravity" else "error"  # what falls feels none
    return [GateFinding(code=code, severity=severity, channel=trio[0].name, detail=detail, message=message)]
