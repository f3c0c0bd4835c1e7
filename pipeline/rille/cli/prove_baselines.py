"""Answers of the baselines to a trial, from what diagnosis gets: the base model, training recordings, and those that were held out."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rille.proof.baselines import BaselineAnswer, ResidualTable, TunedNumber, gaussian_process, named, sindy, tune
from rille.proof.baselines.names import Named

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from rille.model.hypothesis import Hypothesis, Setting
    from rille.model.recording import Recording

WINDOW = 0.5  # [s] of replays
MANY, FEW = 40, 8  # steps of a tuning; few where wheels on the ground take long to simulate
SAME = ("*",)  # targets of parameters that say again what others say
AGAIN = ("stiffness",)  # kinds likewise


def answer_baselines(database: Path, training: Sequence[str], held_out: Sequence[str]) -> dict[str, BaselineAnswer]:
    """Answers of ``sindy``, ``gaussian_process`` and ``tuning``.

    All three are measured alike: R is the root of chi-squared per degree of freedom of the held-out windows (``WINDOW`` long, starts
    smoothed under the base model and marginalised; each point of a bench), R0 of the base model, R1 with the forces that SINDy or the
    process found added to first order, or with the tuned numbers replayed; G = (R0 - R1)/(R0 - 1).

    Raises
    ------
    InputRefused : as ``gather`` and ``gather_bench``.
    """
    from rille import store

    read = [[store.read_recording(database, name) for name in part] for part in (training, held_out)]
    learned, kept = _points(database, *read) if read[0][0].kind == "points" else _times(database, *read)
    tables = learned.table, kept.table
    return {"sindy": sindy(*tables), "gaussian_process": gaussian_process(*tables), "tuning": _tuned(learned, kept)}


class _Side:
    """Recordings of one side: their table, and what they are with other numbers.

    left : settings -> (k, N) whitened residuals. hypotheses : numbers that are tuned.
    """

    def __init__(
        self,
        table: ResidualTable,
        left: "Callable[[Sequence[Setting]], NDArray[np.float64]]",
        window: "NDArray[np.int64]",
        hypotheses: "Sequence[Hypothesis]",
    ) -> None:
        self.table, self.left, self.window, self.hypotheses = table, left, window, tuple(hypotheses)

    def chi2(self, setting: "Setting") -> "NDArray[np.float64]":
        """(W,) chi-squared of a setting."""
        return np.bincount(self.window, np.nan_to_num(self.left([setting])[0], nan=1e3) ** 2).astype(float)


def _times(database: Path, training: "Sequence[Recording]", held_out: "Sequence[Recording]") -> tuple[_Side, _Side]:
    """Recordings over time, replayed."""
    from rille import diagnosis, simulate, store
    from rille.cli.baseline_tables import time_table
    from rille.diagnosis.evidence.evidence import Metric
    from rille.diagnosis.evidence.replay_evidence import gather
    from rille.diagnosis.evidence.window_and_step import window_and_step_of_all
    from rille.diagnosis.hypotheses.candidates import candidates

    noise = diagnosis.shared_noise([*training, *held_out])

    def simulator(scenario: str) -> simulate.Replayer:
        return simulate.Replayer(database, scenario or None)

    fitted, kept = ([replace(r, scenario=store.read_scenario(database, r.scenario).name) for r in side] for side in (training, held_out))
    _, step, rough = window_and_step_of_all(simulator, fitted, noise=noise, window=WINDOW)  # as a diagnosis does
    sides = []
    for placed in (fitted, kept):
        evidence = gather(lambda scenario: simulator(scenario).changed(step=step), placed, window=WINDOW, noise=noise, rough=rough)
        metric = Metric(evidence.window, evidence.start_gain)
        machine = evidence.parts[0].simulator.machine()
        channels = [channel for recording in placed for channel in recording.channels]
        known = candidates(machine, channels, store.effect_kinds())

        def left(settings: "Sequence[Setting]", evidence: Any = evidence, metric: Metric = metric) -> "NDArray[np.float64]":
            return metric.whitened(evidence.residuals(settings))

        sides.append(_Side(time_table(evidence), left, evidence.window, [h for h in known if _is_number(h)]))
    return sides[0], sides[1]


def _points(database: Path, training: "Sequence[Recording]", held_out: "Sequence[Recording]") -> tuple[_Side, _Side]:
    """Points of a bench."""
    from rille.cli.baseline_tables import points_table
    from rille.cli.bench_rigs import bench_rig
    from rille.diagnosis.bench.bench_evidence import gather_bench
    from rille.diagnosis.bench.bench_hypotheses import open_terms

    sides = []
    for recordings in (training, held_out):
        evidence = gather_bench([bench_rig(database, recording)[0] for recording in recordings])
        numbers = [term.hypothesis for term in open_terms(evidence.rigs)]
        sides.append(_Side(points_table(evidence), evidence.residuals, evidence.window, numbers))
    return sides[0], sides[1]


def _is_number(hypothesis: "Hypothesis") -> bool:
    """Whether it is a number of the model: those that may be wrong, masses and centres of mass; none that another says already."""
    if hypothesis.cause == "effect":
        return hypothesis.kind in ("mass_change", "com_offset")
    return hypothesis.cause == "parameter" and hypothesis.target not in SAME and hypothesis.kind not in AGAIN


def _tuned(training: _Side, held_out: _Side) -> BaselineAnswer:
    """The third baseline, its name as diagnosis would say it."""
    hypotheses = training.hypotheses
    numbers = [
        TunedNumber(
            name=Named(cause="parameter", kind=hypothesis.kind, target=hypothesis.target),
            word=f"{number.name} of {hypothesis.title}",
            unit=number.unit,
            value=number.absent,
            lower=number.lower,
            upper=number.upper,
            spread=number.spread,
        )
        for hypothesis in hypotheses
        for number in hypothesis.free
    ]

    def setting(values: "NDArray[np.float64]") -> "Setting":
        at = iter(values.tolist())
        return tuple(hypothesis.at({number.name: next(at) for number in hypothesis.free}) for hypothesis in hypotheses)

    few = FEW if training.table.scope.wheels and not training.table.scope.channels else MANY
    tuned = tune(numbers, lambda values: training.left([setting(row) for row in values]), few)
    degrees = held_out.table.degrees
    before, after = held_out.chi2(()), held_out.chi2(setting(tuned.values))
    total = np.array([degrees.sum()])
    return named(numbers, tuned, (before, total), (after, total))


def main() -> None:
    """Answers for the recordings of a database as JSON on stdout, in a trial's room: ``python -m rille.cli.prove_baselines MODEL.db``."""
    import json
    import sys

    from rille import store
    from rille.proof.trials import HELD_OUT

    database = Path(sys.argv[1])
    names = store.recording_names(database)
    answers = answer_baselines(database, [name for name in names if name != HELD_OUT], [HELD_OUT])
    print(json.dumps({name: answer.as_json() for name, answer in answers.items()}))


if __name__ == "__main__":
    main()
