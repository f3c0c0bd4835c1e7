"""The data gate for points of a wheel bench: units and signs that no wheel can have, values that are stuck or missing."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import Channel, GateFinding, Recording
from rille.recording.points import condition_channel

Array = NDArray[np.float64]
FEW = 6  # points from which on a sign is judged
SURE = 3.0  # standard errors
WHEEL = (1e-3, 5.0)  # [m] radii and widths that wheels have


def points_findings(recording: Recording) -> tuple[GateFinding, ...]:
    """What is wrong or remarkable in a recording of kind points."""
    if recording.kind != "points":
        return ()
    found: list[GateFinding] = []
    for channel in recording.channels:
        if channel.role != "ignore":
            found += [*_missing(channel), *_range(channel), *_stuck(channel)]
    return (*_wheel(recording), *found, *_depth(recording), *_signs(recording), *_doubles(recording))


def _wheel(recording: Recording) -> Iterator[GateFinding]:
    """A size of the wheel that is in another unit."""
    for name in ("radius", "width"):
        size = _sizes(recording).get(name)
        if size is not None and not WHEEL[0] <= size <= WHEEL[1]:
            fix = f'state its unit: {name} = "{size:g} mm"' if size > WHEEL[1] else "check its unit"
            text = f"[bench] states a wheel with a {name} of {size:g} m, where wheels have {WHEEL[0]:g} to {WHEEL[1]:g} m; {fix}"
            yield GateFinding(code="range", severity="error", detail={"value": size, "bounds": list(WHEEL)}, message=text)


def _sizes(recording: Recording) -> Mapping[str, float]:
    """Sizes of the wheel [m] by name, as far as the manifest states them."""
    return recording.setup.get("wheel") or {}  # pyright: ignore[reportReturnType]


def _depth(recording: Recording) -> Iterator[GateFinding]:
    """Sinkage beyond the wheel, of that the manifest states, else of the largest that there is."""
    sizes = _sizes(recording)
    reach = sizes.get("radius", WHEEL[1]) + sizes.get("grouser_height", 0.0)
    unknown_zero = recording.setup.get("unknown_zero") or ()
    for channel in recording.with_role("observed"):
        if channel.quantity == "wheel.sinkage" and channel.name not in unknown_zero:  # pyright: ignore[reportOperatorIssue]
            told = too_deep(channel.value, reach)
            if told is not None:
                text = f"{channel.name} {told}; check the unit of both"
                severity = "error" if buried(channel.value, reach) else "warning"
                detail = {"value": float(np.nanmax(channel.value)), "bound": reach}
                yield GateFinding(code="range", severity=severity, channel=channel.name, detail=detail, message=text)


def buried(sinkage: Array, reach: float) -> bool:
    """Whether most of the sinkages, (n,) [m], are beyond the diameter of a wheel. reach : [m] its radius with its grousers."""
    known = sinkage[np.isfinite(sinkage)]
    return bool(len(known)) and float(np.median(known)) > 2 * reach


def too_deep(sinkage: Array, reach: float) -> str | None:
    """What is to be said of sinkages, (n,) [m], beyond the radius of a wheel; None if there are none. reach : as of ``buried``."""
    deepest = float(np.max(sinkage, where=np.isfinite(sinkage), initial=-np.inf))
    return f"reaches {deepest:.4g} m as sinkage of a wheel whose radius is {reach:.4g} m with its grousers" if deepest > reach else None


def _missing(channel: Channel) -> Iterator[GateFinding]:
    count = int((~np.isfinite(channel.value)).sum())
    if count:
        n = len(channel.value)
        severity = "warning" if count == n else "note"
        text = f"{channel.name} has no value at {count} of {n} points; they are left out of its comparison"
        yield GateFinding(code="missing", severity=severity, channel=channel.name, detail={"count": count, "of": n}, message=text)


def _range(channel: Channel) -> Iterator[GateFinding]:
    """Conditions that no wheel can have: percent, degrees and turned signs."""
    known = channel.value[np.isfinite(channel.value)]
    if not len(known):
        return
    most, median = float(np.abs(known).max()), float(np.median(known))
    if channel.quantity == "wheel.slip_ratio" and most > 1.02:
        guess = 'it looks like percent: state unit = "percent"' if most > 5 else "check how it was formed"
        text = f"{channel.name} reaches {most:.3g} as slip ratio, beyond 1; {guess}"
        yield GateFinding(code="range", severity="error", channel=channel.name, detail={"value": most, "bound": 1.0}, message=text)
    if channel.quantity == "wheel.slip_angle" and most > np.pi / 2 + 1e-6:
        text = f'{channel.name} reaches {most:.3g} rad as slip angle, beyond a quarter turn; it looks like degrees: state unit = "deg"'
        yield GateFinding(code="range", severity="error", channel=channel.name, detail={"value": most, "bound": np.pi / 2}, message=text)
    if channel.quantity == "wheel.normal_load" and (known <= 0).any():
        count = int((known <= 0).sum())
        guess = "its axis points downward: state scale = -1" if median < 0 else "the wheel was in the air there: these points are left out"
        text = f"{channel.name} is 0 or below at {count} of {len(known)} points as normal load, which presses on the ground; {guess}"
        code, severity = ("sign", "error") if median < 0 else ("range", "warning")
        detail = {"value": float(known.min()), "count": count}
        yield GateFinding(code=code, severity=severity, channel=channel.name, detail=detail, message=text)
    if channel.quantity == "wheel.sinkage" and len(known) >= FEW and median < 0:
        text = f"{channel.name} is negative at most points as sinkage, which is positive downward; state scale = -1, or correct its zero"
        yield GateFinding(code="sign", severity="warning", channel=channel.name, detail={"median": median}, message=text)


def _stuck(channel: Channel) -> Iterator[GateFinding]:
    known = channel.value[np.isfinite(channel.value)]
    if channel.role == "observed" and len(known) >= FEW and np.ptp(known) == 0:
        text = f"{channel.name} is {known[0]:.6g} at all {len(known)} points; a response that never changes was not measured: leave it out"
        yield GateFinding(code="stuck", severity="warning", channel=channel.name, detail={"value": float(known[0])}, message=text)


def _signs(recording: Recording) -> Iterator[GateFinding]:
    """Pull and torque grow with slip, side force is against the drift: whatever the soil."""
    slip, angle = condition_channel(recording, "slip_ratio"), condition_channel(recording, "slip_angle")
    still = np.abs(angle.value) <= np.nanmin(np.abs(angle.value)) + 0.01 if angle is not None and np.isfinite(angle.value).any() else True
    for channel in recording.with_role("observed"):
        if channel.quantity in ("wheel.drawbar_pull", "wheel.drive_torque") and slip is not None and channel is not slip:
            here = np.isfinite(channel.value) & np.isfinite(slip.value) & still
            score = _trend(slip.value[here], channel.value[here])
            if score < -SURE:
                text = f"{channel.name} falls with slip ({-score:.1f} standard errors), though {_what(channel)} grows; state scale = -1?"
                yield GateFinding(code="sign", severity="warning", channel=channel.name, detail={"standard_errors": score}, message=text)
        if channel.quantity == "wheel.side_force" and angle is not None:
            drifting = np.isfinite(channel.value) & (np.abs(angle.value) > 0.05)
            along = channel.value[drifting] * np.sign(angle.value[drifting])
            if len(along) >= FEW and along.mean() < -SURE * along.std(ddof=1) / np.sqrt(len(along)):
                text = (
                    f"{channel.name} points along the drift (mean {along.mean():.3g} N), though side force is against it; state scale = -1?"
                )
                yield GateFinding(code="sign", severity="warning", channel=channel.name, detail={"mean": float(along.mean())}, message=text)


def _what(channel: Channel) -> str:
    return "drawbar pull" if channel.quantity == "wheel.drawbar_pull" else "drive torque"


def _trend(x: Array, y: Array) -> float:
    """Slope of y over x in standard errors (Spearman's rank correlation times sqrt(n - 1)); 0 where it cannot be told."""
    if len(x) < FEW or np.ptp(x) == 0 or np.ptp(y) == 0:
        return 0.0
    ranks = [np.argsort(np.argsort(values, kind="stable"), kind="stable").astype(float) for values in (x, y)]
    return float(np.corrcoef(ranks[0], ranks[1])[0, 1] * np.sqrt(len(x) - 1))


def _doubles(recording: Recording) -> Iterator[GateFinding]:
    """Rows that are there twice: they are no repeats and would make the noise too small."""
    values = [c.value for c in recording.channels if c.role != "ignore" and len(c.value)]
    if not values or len({len(v) for v in values}) > 1 or not any(c.role == "observed" for c in recording.channels):
        return
    rows = np.nan_to_num(np.column_stack(values), nan=np.inf)
    count = len(rows) - len(np.unique(rows, axis=0))
    if count:
        text = (
            f"{count} points are there twice, equal in every channel; copies are no repeats: remove them, for they make the noise too small"
        )
        yield GateFinding(code="duplicates", severity="warning", detail={"count": count}, message=text)
