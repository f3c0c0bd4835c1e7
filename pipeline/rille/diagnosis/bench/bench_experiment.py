"""Which points to measure next: the sweep of a bench in which hypotheses that its points cannot tell apart differ most.

Each member of a group predicts each sweep with the numbers it was fitted with. What its own numbers could still make of the sweep counts
for nothing: with the change d [sigma] between two members, their derivatives G by their numbers and the covariances C of these,
d^T (I + G C G^T + G' C' G'^T)^-1 d is the expected log-likelihood ratio times two.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from rille.diagnosis.bench.bench_calibration import WEAK, free_numbers, with_numbers
from rille.diagnosis.bench.bench_evidence import BenchEvidence
from rille.diagnosis.bench.bench_rig import BenchRig, faulty, responses
from rille.diagnosis.bench.bench_search import Rival, Round
from rille.diagnosis.evidence.evidence import Array
from rille.model import BenchPoints
from rille.model.diagnosis import Experiment
from rille.model.hypothesis import Setting

MOST = 3  # sweeps that are told
MOST_MEMBERS = 4
ENOUGH = 3.0  # [sigma] less separates nothing
SLIPS = np.linspace(-0.2, 0.8, 11)
ANGLES = np.radians(np.linspace(0.0, 40.0, 9))
LOADS = np.geomspace(0.5, 2.0, 9)  # of the usual load: beyond that a soil that was fitted here says little
SLIPPING = 0.3
STEP = 1e-2  # [spreads] of a derivative


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """Points in a row, one of each. wider : width of the wheel over that of the rig."""

    name: str
    purpose: str
    points: BenchPoints
    wider: float = 1.0


def next_points(evidence: BenchEvidence, found: Round) -> tuple[Experiment, ...]:
    """Sweeps that separate the members of a round's group, best first; none if it has one member."""
    members = [found.rivals[k] for k in found.group[:MOST_MEMBERS]]
    if len(members) < 2:
        return ()
    rig = max(range(len(evidence.rigs)), key=lambda k: len(evidence.points[k]))
    now = float(np.sqrt(2 * max(0.0, min(found.behind[k] for k in found.group[1:]))))
    told = []
    for sweep in _sweeps(evidence, rig):
        here = _Bench(evidence, rig, sweep)
        pairs = list(combinations(members, 2))
        apart = [here.separation(one, other) for one, other in pairs]
        hardest = int(np.argmin(apart))
        told.append(_experiment(sweep, *pairs[hardest], apart[hardest], now))
    told.sort(key=lambda e: -e.separation)
    return tuple(e for k, e in enumerate(told[:MOST]) if k == 0 or e.separation >= ENOUGH)


def _sweeps(evidence: BenchEvidence, rig: int) -> Iterator[Sweep]:
    """About the usual load of a rig."""
    points = evidence.points[rig]
    usual = float(np.median(points.load))
    for factor, word in ((1.0, ""), (0.5, "_light"), (2.0, "_heavy")):
        load = factor * usual
        yield Sweep(
            name=f"slip_sweep{word}",
            purpose=f"slip ratio {SLIPS[0]:.1f} to {SLIPS[-1]:.1f} at {load:.3g} N, straight on",
            points=BenchPoints.at(load, SLIPS),
        )
    for slip, word in ((0.0, "rolling"), (SLIPPING, "slipping")):
        yield Sweep(
            name=f"load_sweep_{word}",
            purpose=f"load {LOADS[0] * usual:.3g} to {LOADS[-1] * usual:.3g} N at slip ratio {slip:g}, straight on",
            points=BenchPoints.at(usual * LOADS, slip),
        )
    yield Sweep(
        name="slip_angle_sweep",
        purpose=f"slip angle 0 to {np.degrees(ANGLES[-1]):.0f} deg at {usual:.3g} N and slip ratio {SLIPPING:g}",
        points=BenchPoints.at(usual, SLIPPING, ANGLES),
    )
    for wider in (0.5, 2.0):
        width = 1e3 * wider * evidence.rigs[rig].shape.width
        yield Sweep(
            name="slip_sweep_narrow_wheel" if wider < 1 else "slip_sweep_wide_wheel",
            purpose=f"slip ratio {SLIPS[0]:.1f} to {SLIPS[-1]:.1f} at {usual:.3g} N with a wheel of {width:.3g} mm width",
            points=BenchPoints.at(usual, SLIPS),
            wider=wider,
        )


class _Bench:
    """What members say of a sweep, in sigmas of the channels that the rig has."""

    def __init__(self, evidence: BenchEvidence, rig: int, sweep: Sweep) -> None:
        own: BenchRig = evidence.rigs[rig]
        self.rig = replace(own, shape=replace(own.shape, width=sweep.wider * own.shape.width))
        self.points = sweep.points
        measured = [part for part in evidence.parts if part.rig == rig]
        self.sensors = [(p.channel, p.response, float(evidence.sigma[p.place][0])) for p in measured]

    def separation(self, one: Rival, other: Rival) -> float:
        """Expected difference [sigma] that neither member can make up by its numbers."""
        here, there = (self._shown(member.whole.setting) for member in (one, other))
        carried = np.isfinite(here) & np.isfinite(there)
        kappa = max(1.0, max(m.whole.chi2 / max(np.subtract(*m.whole.jacobian.shape), 1) for m in (one, other)))
        spread = np.eye(int(carried.sum()))
        for member, shown in ((one, here), (other, there)):
            gain = self._gain(member, shown)[carried] / np.sqrt(kappa)
            spread += gain @ _covariance(member, kappa) @ gain.T
        change = (there - here)[carried] / np.sqrt(kappa)
        return float(np.sqrt(max(change @ np.linalg.solve(spread, change), 0.0))) if carried.any() else 0.0

    def _shown(self, setting: Setting) -> Array:
        """(N,) [sigma] of all channels, one after the other; NaN where the soil does not carry."""
        found, _ = responses(self.rig, self.points, setting)
        values = [faulty(channel, getattr(found, response), setting, self.rig) / sigma for channel, response, sigma in self.sensors]
        return np.concatenate(values)

    def _gain(self, member: Rival, shown: Array) -> Array:
        """(N, p) derivatives by the member's numbers in spreads."""
        numbers = free_numbers(member.whole.setting)
        columns = []
        for k, number in enumerate(numbers):
            values = [value for term in member.whole.setting for value in term.values]
            step = STEP if values[k] + STEP * number.spread <= number.upper else -STEP
            values[k] += step * number.spread
            columns.append((self._shown(with_numbers(member.whole.setting, values)) - shown) / step)
        return np.nan_to_num(np.stack(columns, axis=1)) if columns else np.empty((len(shown), 0))


def _covariance(member: Rival, kappa: float) -> Array:
    """(p, p) of a member's numbers in spreads: what the points and the priors leave open."""
    jacobian, added = member.whole.jacobian, sum(len(term.hypothesis.free) for term in member.extra)
    weight = np.ones(jacobian.shape[1])
    weight[len(weight) - added :] = 1.0 / WEAK
    return np.asarray(np.linalg.inv(jacobian.T @ jacobian / kappa + np.diag(weight**2)), dtype=float)


def _experiment(sweep: Sweep, one: Rival, other: Rival, separation: float, now: float) -> Experiment:
    verdict = f"is expected to tell '{one.title}' from '{other.title}' by {separation:.1f} sigmas (these points: {now:.1f})"
    if separation < ENOUGH:
        verdict = (
            f"tells '{one.title}' from '{other.title}' by {separation:.1f} sigmas only, and no sweep of slip, load, slip angle or width "
            "does better: more repeats, or another sensor, are needed"
        )
    rows = zip(sweep.points.load, sweep.points.slip_ratio, np.degrees(sweep.points.slip_angle), strict=True)
    table = "\n".join(["load [N],slip ratio,slip angle [deg]", *(f"{w:.4g},{s:.3g},{a:.3g}" for w, s, a in rows)])
    return Experiment(
        name=sweep.name,
        purpose=sweep.purpose,
        separation=separation,
        points=table + "\n",
        sentence=f"'{sweep.name}' ({sweep.purpose}) {verdict}",
        now=now,
    )
