"""Pushes at the joints of a mechanism that the world holds, from recordings as they are: what is calibrated, then what stands out of it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rille.diagnosis.evidence.applied import applied
from rille.diagnosis.hypotheses.candidates import candidates
from rille.diagnosis.pushes.effort_fit import Leading, fit_efforts
from rille.diagnosis.pushes.effort_uncertainty import EffortUncertainty, calibrate
from rille.diagnosis.pushes.residual_effort import ResidualEffort, residual_effort
from rille.diagnosis.pushes.transients import Alarm, alarms, find_pulses
from rille.model import EffectKind, InputRefused
from rille.model.diagnosis import Transient
from rille.model.hypothesis import Setting
from rille.model.recording import Recording

Told = Callable[[int, int, str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class PushCalibration:
    """What recordings without pushes teach.

    setting : what the model lacks there. leading : the few laws and numbers of it that matter most. uncertainty : what the model still is
    wrong by. alarm : scores that come up though nothing pushes.
    """

    setting: Setting
    leading: tuple[Leading, ...]
    uncertainty: EffortUncertainty
    alarm: Alarm


def calibrate_pushes(
    simulator: Any, clean: Sequence[Recording], kinds: Sequence[EffectKind], *, on_progress: Told | None = None
) -> PushCalibration:
    """Learn from recordings in which nothing pushed.

    Parameters
    ----------
    simulator : as ``rille.simulate.Replayer``. clean : grouped by what their names have before the last '/': recordings of one group were
        made together. Two groups or more teach what differs from one day to the next. kinds : the catalogue.

    Raises
    ------
    InputRefused : without clean recordings, and as of ``residual_effort``.
    """
    if not clean:
        raise InputRefused("pushes are told from the model's own errors by recordings in which nothing pushed; name at least one")

    def told(stage: str, done: int, total: int) -> None:
        if on_progress:
            on_progress(done, total, stage)

    raw = [_effort(simulator, recording, (), told, k, len(clean)) for k, recording in enumerate(clean)]
    hypotheses = candidates(simulator.machine(), clean[0].channels, kinds)
    fitted = fit_efforts(simulator, list(zip(clean, raw, strict=True)), hypotheses, on_progress=on_progress)
    setting = fitted.setting
    groups: dict[str, list[ResidualEffort]] = {}
    for k, recording in enumerate(clean):
        groups.setdefault(_group(recording.name), []).append(_effort(simulator, recording, setting, told, k, len(clean)))
    uncertainty = calibrate(list(groups.values()), on_progress=on_progress)
    return PushCalibration(
        setting=setting, leading=fitted.leading, uncertainty=uncertainty, alarm=alarms(list(groups.values()), uncertainty)
    )


def find_pushes(
    simulator: Any, recordings: Sequence[Recording], calibration: PushCalibration, *, on_progress: Told | None = None
) -> tuple[Transient, ...]:
    """Pushes in recordings, in their order and that of time. Those of one group (``calibrate_pushes``) are judged together.

    Raises
    ------
    InputRefused : as of ``residual_effort``.
    """

    def told(stage: str, done: int, total: int) -> None:
        if on_progress:
            on_progress(done, total, stage)

    groups: dict[str, list[ResidualEffort]] = {}
    for k, recording in enumerate(recordings):
        groups.setdefault(_group(recording.name), []).append(_effort(simulator, recording, calibration.setting, told, k, len(recordings)))
    found: Mapping[str, list[Transient]] = {recording.name: [] for recording in recordings}
    for group in groups.values():
        for push in find_pulses(group, calibration.uncertainty, calibration.alarm, on_progress=on_progress):
            found[push.recording].append(push)
    return tuple(push for pushes in found.values() for push in pushes)


def _effort(simulator: Any, recording: Recording, setting: Setting, told: Callable[[str, int, int], None], done: int, total: int) -> Any:
    told(f"residual effort of {recording.name}", done, total)
    simulator.drive_by(recording)
    return residual_effort(applied(simulator, setting), recording)


def _group(name: str) -> str:
    return name.rpartition("/")[0] or name
