"""Where to begin to look for a place: along the track, where it differs if that is known; about a machine that the world holds."""

from collections.abc import Mapping, Sequence

import numpy as np

from rille.diagnosis.hypotheses.natural import Natural
from rille.model.diagnosis import Location
from rille.model.hypothesis import FreeNumber, Hypothesis
from rille.model.machine import Machine

FACTORS = (1.0, 0.3)  # of sizes that go with a place: lengths, radii
AWAY = (1.0, 4.0)  # [reach of a body] that places about it are away


def place_tries(
    hypotheses: Sequence[Hypothesis], machine: Machine, scales: Natural, location: Location | None = None, most: int = 12
) -> Mapping[str, tuple[Mapping[str, float], ...]]:
    """For each hypothesis (by title) that has coordinates of a place: values of its numbers that are no amplitudes.

    The coordinates are tried together, at points evenly along the track, or along those spans of it that differ where the difference is
    one of places or short; sizes that go with them at their usual value and at a third of it. At most ``most`` sets each. About a body of
    a machine that does not travel: on its six sides, near and far, with sizes that just reach it.
    """
    found = {}
    for hypothesis in hypotheses:
        places = [n for n in hypothesis.free if n.search == "place"]
        if not places:
            continue
        usual = {n.name: n.start for n in hypothesis.free if not n.amplitude}
        sizes = [n for n in hypothesis.free if n.search == "scale" and not n.amplitude]
        if hypothesis.target_kind == "body" and not machine.root:
            found[hypothesis.title] = tuple(usual | about for about in _about(hypothesis, machine, places, sizes))
            continue
        factors = FACTORS if sizes else FACTORS[:1]
        points = _points(scales, location, max(1, most // len(factors)))
        sets = [
            usual
            | {n.name: min(max(factor * n.start, n.lower), n.upper) for n in sizes}
            | {n.name: float(point["xyz".find(n.name[-1])]) for n in places}
            for factor in factors
            for point in points
        ]
        found[hypothesis.title] = tuple(sets) if sets else (usual,)
    return found


def _about(hypothesis: Hypothesis, machine: Machine, places: Sequence[FreeNumber], sizes: Sequence[FreeNumber]) -> list[dict[str, float]]:
    """Places about a body as it hangs in the model."""
    com = np.array(next(b.com for b in machine.bodies if b.name == hypothesis.target), dtype=float)
    bases = [np.array(j.point, dtype=float) for j in machine.joints if not j.parent] or [np.zeros(3)]
    reach = max(float(np.linalg.norm(com - bases[0])), 1e-3)
    found = []
    for away in AWAY:
        for side in (*np.eye(3), *-np.eye(3)):
            point = com + away * reach * side
            sets = {n.name: float(point["xyz".find(n.name[-1])]) for n in places}
            found.append(sets | {n.name: min(max(away * reach, n.lower), n.upper) for n in sizes})
    return found


def _points(scales: Natural, location: Location | None, most: int) -> np.ndarray:
    """(k, 3) [m] of the track."""
    track, times = scales.track, scales.track_time
    if location is not None and location.shape in ("place", "transient") and location.spans and len(track):
        inside = np.zeros(len(track), dtype=bool)
        for span in location.spans:
            inside |= (times >= span.start) & (times <= span.stop)
        track = track[inside] if inside.any() else track
    if not len(track):
        return track
    along = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(track[:, :2], axis=0), axis=1))]
    at = np.interp(np.linspace(0.0, along[-1], most + 2)[1:-1], along, np.arange(len(track))).round().astype(int)
    return track[np.unique(at)]
