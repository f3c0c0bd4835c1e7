"""Interference as findings."""

from collections.abc import Iterator, Mapping

import numpy as np

from rille.cad.checks.finding import Finding
from rille.cad.checks.interference import Interference, InterferenceReport
from rille.model import Rover

RESTING = 0.01


def check_ranges(rover: Rover, report: InterferenceReport) -> Iterator[Finding]:
    """What an :class:`InterferenceReport` says, as findings; the deepest overlap first."""
    for rest in report.rest:
        if rest.fraction > RESTING:
            yield Finding(
                code="interference.zero",
                severity="note",
                subject=f"{rest.body_a}, {rest.body_b}",
                value=rest.volume * 1e9,
                bound=RESTING * rest.volume / rest.fraction * 1e9,
                unit="mm^3",
                sentence=f"bodies '{rest.body_a}' and '{rest.body_b}' overlap at the zero pose by {rest.volume * 1e9:.4g} mm^3, "
                f"{rest.fraction:.1%} of the "
                f"smaller one (allowed {RESTING:.0%}); fine for simplified drawings, else correct the place of a part; this overlap is "
                "not counted below",
            )
    for reach in report.reaches:
        yield Finding(
            code="limits.unreachable",
            severity="note" if reach.approximate else "warning",
            subject=reach.joint,
            value=reach.reached,
            bound=reach.limit,
            unit="rad" if reach.kind == "hinge" else "m",
            sentence=f"joint '{reach.joint}' reaches {_position(reach.reached, reach.kind)} of its limit of "
            f"{_position(reach.limit, reach.kind)}: there "
            f"'{reach.body_a}' runs into '{reach.body_b}'{' (convex hull)' if reach.approximate else ''}; narrow the limit, or make room",
        )
    kinds = {joint.name: joint.kind for joint in rover.joints}
    for pair in report.found:
        yield Finding(
            code="interference.range",
            severity="note" if pair.approximate else "warning",
            subject=f"{pair.body_a}, {pair.body_b}",
            value=pair.volume * 1e9,
            bound=0.0,
            unit="mm^3",
            sentence=f"bodies '{pair.body_a}' and '{pair.body_b}' run into each other by {pair.volume * 1e9:.4g} mm^3, "
            f"{pair.depth * 1e3:.3g} mm deep on average"
            f"{' (by the convex hull)' if pair.approximate else ''}, allowed 0, worst at {describe(pair, kinds)} ({pair.count} of "
            f"{report.poses} poses); "
            "narrow the limits of these joints, or make room",
        )
    for note in report.notes:
        yield Finding(code="interference.skipped", severity="note", subject="interference", value=None, bound=None, unit="", sentence=note)


def describe(pair: Interference, kinds: Mapping[str, str]) -> str:
    """Joint positions of the worst pose, as text; those at zero are not named."""
    named = [f"{name} = {_position(value, kinds[name])}" for name, value in pair.positions.items() if abs(value) > 1e-9]
    return ", ".join(named) or "the zero pose"


def _position(value: float, kind: str) -> str:
    return f"{np.rad2deg(value):.1f} deg" if kind == "hinge" else f"{value * 1e3:.2f} mm"
