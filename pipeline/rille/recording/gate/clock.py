"""Is the clock one: forward, without gaps, and in a unit that a machine could have been recorded in?"""

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from rille.model.recording import GateFinding

Array = NDArray[np.float64]
FASTEST = 20_000.0  # [Hz] a machine's logger is slower
SLOWEST = 5.0  # [s] between samples; a log of a moving machine is denser
SLOWEST_RATES = 1.0  # [s] the same where rates or efforts were recorded: sampled more slowly they tell nothing of a motion
RATES = ("joint.velocity", "joint.effort", "part.linear_velocity", "part.angular_velocity", "part.linear_acceleration")
MANY = 100  # samples of a regular clock from which ``SLOWEST_RATES`` holds
SHORT = {1e3: "ms", 1e6: "us", 1e9: "ns"}
MIXED_UP = 0.1  # share of samples that go back, from which a clock is in no order
MIXED = 20.0  # intervals: a clock that jumps back by more has begun anew, and messages were not merely mixed up


def check_clock(name: str, time: Array, *, moving: bool = True, rates: bool = False) -> list[GateFinding]:
    """Findings about stamps (n,) [s]: backwards, duplicates, gaps, lost samples, jitter, and a rate that no logger has.

    moving : False: nothing changes over time, so that the rate proves nothing. rates : an observed channel of it is one of ``RATES``.
    """
    if len(time) < 2:
        return []
    if not np.isfinite(time).all():
        bad = int((~np.isfinite(time)).sum())
        message = f"clock '{name}': {bad} of {len(time)} stamps are no numbers; remove those rows from the file"
        return [GateFinding(code="clock_not_finite", severity="error", channel=name, detail={"count": bad}, message=message)]
    interval = np.diff(time)
    found = _order(name, time, interval)
    forward = interval[interval > 0]
    if len(forward) and np.mean(interval < 0) < MIXED_UP:  # intervals of samples in no order are those of no logger
        found += _rate(name, forward, time, moving, rates) + _gaps(name, time, interval, forward) + _jitter(name, forward)
    return found


def check_common_time(spans: Mapping[str, tuple[float, float]], commands: Collection[str]) -> list[GateFinding]:
    """A finding for each clock that has no time in common with the longest one: they count from different beginnings.

    spans : first and last stamp [s] of each clock. commands : those that stamp commands alone. A command holds until the next one, so that
    all of them may be earlier than what was observed, but not later.
    """
    observed = {name: span for name, span in spans.items() if name not in commands}
    if not observed:
        return []
    longest = max(observed, key=lambda name: observed[name][1] - observed[name][0])
    begin, end = observed[longest]
    found = []
    for name, (first, last) in spans.items():
        early, late = last < begin and name not in commands, first > end
        if early or late:
            message = (
                f"clock '{name}' stamps {first:.6g} to {last:.6g} s, clock '{longest}' {begin:.6g} to {end:.6g} s: they have no time in "
                f'common; state a [[correction]] kind = "shift_clock" with clock = "{name}", by = what is to be added to its stamps, and '
                "the reason"
            )
            detail = {"first": first, "last": last, "other": longest, "other_first": begin, "other_last": end}
            found.append(GateFinding(code="clocks_apart", severity="error", channel=name, detail=detail, message=message))
    return found


def _order(name: str, time: Array, interval: Array) -> list[GateFinding]:
    found = []
    back = np.flatnonzero(interval < 0)
    if len(back):
        k = int(back[0])
        message = (
            f"clock '{name}' runs backwards at {len(back)} of {len(time)} samples, first after {time[k]:.6g} s, by {-interval[k]:.3g} s; "
            + (
                "it begins anew there: cut the file, or repair its clock (sorting would mix two stretches of time)"
                if float(-interval[back].min()) > MIXED * float(np.median(np.abs(interval)))
                else 'state a [[correction]] kind = "sort" with its reason, or repair the file'
            )
        )
        detail = {"count": len(back), "first": float(time[k]), "largest": float(-interval[back].min())}
        found.append(GateFinding(code="clock_backwards", severity="error", channel=name, detail=detail, message=message))
    same = np.flatnonzero(interval == 0)
    if len(same):
        message = (
            f"clock '{name}' stamps {len(same)} of {len(time)} samples with the time of the one before, first at {time[same[0]]:.6g} s; "
            'state a [[correction]] kind = "drop_duplicates" with its reason (each channel keeps its first value of a time)'
        )
        detail = {"count": len(same), "first": float(time[same[0]])}
        found.append(GateFinding(code="clock_duplicates", severity="error", channel=name, detail=detail, message=message))
    return found


def _rate(name: str, forward: Array, time: Array, moving: bool, rates: bool) -> list[GateFinding]:
    step = float(np.median(forward))
    if step < 1 / FASTEST:
        factor = next((f for f in (1e3, 1e6, 1e9) if step * f > 5e-5), 1e9)
        means = f"{1 / step:.4g} Hz; were the stamps {SHORT[factor]} too short by unit, it would be {1 / (step * factor):.4g} Hz"
        message = f"clock '{name}' has a median interval of {step:.3g} s, that is {means}; state the unit of [time] {factor:g} times larger"
        detail = {"step": step, "factor": factor}
        return [GateFinding(code="time_unit", severity="error", channel=name, detail=detail, message=message)]
    whole = bool(np.all(time[:10_000] == np.round(time[:10_000]))) and len(time) > 10
    regular = float(np.quantile(forward, 0.9)) < 1.2 * step
    slowest = SLOWEST_RATES if rates and regular and len(time) > MANY else SLOWEST
    if moving and (step > slowest or (step >= 2 and whole)):
        factor = next((f for f in (1e3, 1e6, 1e9) if step / f < 2), 1e9)
        what = "whole numbers with " if whole else ""
        message = (
            f"clock '{name}' has {what}a median interval of {step:.4g} s and lasts {time[-1] - time[0]:.4g} s; stamps in {SHORT[factor]} "
            f'would mean {factor / step:.4g} Hz: state unit = "{SHORT[factor]}" in [time] if that is so, or accept "time_unit"'
        )
        detail = {"step": step, "unit": SHORT[factor]}
        return [GateFinding(code="time_unit", severity="error", channel=name, detail=detail, message=message)]
    return []


def _gaps(name: str, time: Array, interval: Array, forward: Array) -> list[GateFinding]:
    step, usual = float(np.median(forward)), float(np.quantile(forward, 0.9))
    found = []
    least = max(5.5 * step, 6 * usual)
    gaps = np.flatnonzero(interval > least)
    if len(gaps):
        longest = gaps[np.argmax(interval[gaps])]
        message = (
            f"clock '{name}' has {len(gaps)} gap{'s' if len(gaps) > 1 else ''} of more than {least:.3g} s, the longest of "
            f"{interval[longest]:.4g} s after {time[longest]:.6g} s (median interval {step:.3g} s)"
        )
        worst = gaps[np.argsort(interval[gaps])[::-1][:50]]
        detail = {"count": len(gaps), "intervals": [[float(time[k]), float(time[k + 1])] for k in sorted(worst)], "step": step}
        found.append(GateFinding(code="clock_gap", severity="warning", channel=name, detail=detail, message=message))
    if usual < 1.2 * step:  # a regular clock, so that single samples can be missed
        lost = np.round(interval / step) - 1
        lost = lost[(lost >= 1) & (interval <= 5.5 * step)]
        if len(lost):
            message = f"clock '{name}' lost {int(lost.sum())} single samples at {len(lost)} places, {lost.sum() / len(time):.2%} of all"
            detail = {"count": int(lost.sum()), "fraction": float(lost.sum() / len(time))}
            found.append(GateFinding(code="clock_lost", severity="note", channel=name, detail=detail, message=message))
    return found


def _jitter(name: str, forward: Array) -> list[GateFinding]:
    step = float(np.median(forward))
    usual = forward[forward < 5.5 * step]
    jitter = float(np.std(usual))
    if jitter < 0.02 * step:
        return []
    message = f"clock '{name}' is irregular: intervals of {step:.4g} s (median) with a standard deviation of {jitter:.3g} s"
    detail = {"step": step, "jitter": jitter, "shortest": float(usual.min()), "longest": float(usual.max())}
    return [GateFinding(code="clock_jitter", severity="note", channel=name, detail=detail, message=message)]
