"""Evidence of one recording as a comparison: the recording beside what its fitted starts give."""

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.comparison.compare import NO_NOISE, notes_on, samples_of, why_unfit, within
from rille.diagnosis.comparison.pooled import root_mean_square
from rille.diagnosis.evidence.applied import applied, sensor_terms
from rille.diagnosis.evidence.evidence_part import Part
from rille.diagnosis.hypotheses.sensor_faults import said, true_instants
from rille.diagnosis.starts.noise_floor import noise_of
from rille.diagnosis.starts.quaternion_sign import with_steady_quaternions
from rille.diagnosis.starts.start_fit import Samples, residuals
from rille.diagnosis.starts.windows import Cut
from rille.model.comparison import ComparedChannel, CompareWindow, Comparison
from rille.model.hypothesis import Setting
from rille.model.recording import Channel

Array = NDArray[np.float64]


def comparison_of(part: Part, setting: Setting | None = None) -> Comparison:
    """The recording beside the model of a setting from the fitted starts, its sensors as faulty as the setting says, what the step does
    taken off. Channels that took no part are there, too, with the reason.

    setting : None: the one under which the starts were fitted.
    """
    assumed = part.assumed if setting is None else setting
    model, faults = applied(part.simulator, assumed), sensor_terms(assumed)
    rest = [(s, noise_of(c)[1], why) for c, s, why in _left_out(part)]
    samples = [*part.samples, *(s for s, *_ in rest)]
    picks = [(s.window, true_instants(faults, s.channel, s.time)) for s in samples]
    answers = model.predict(part.states[None], part.last, [s.channel for s in samples], picks)
    own = zip(part.error, part.timing, part.gain, part.noise_from, [""] * len(part.samples), strict=True)
    others = [(*(np.zeros(len(s.time)) for _ in range(3)), source, why) for s, source, why in rest]
    channels, unreached = [], set()
    for s, (error, timing, gain, source, why), answer in zip(samples, [*own, *others], answers, strict=True):
        simulated = s.value - residuals(s, said(faults, s.channel, answer[0] - error, s.time))
        reached = np.isfinite(simulated)
        unreached |= set(s.window[~reached].tolist())
        channels.append(
            ComparedChannel(
                channel=s.channel,
                time=s.time[reached] + s.channel.delay,
                measured=s.value[reached],
                simulated=simulated[reached],
                window=s.window[reached],
                noise=s.noise,
                noise_from=source,
                left_out=why,
                start_gain=gain[reached],
                instants=root_mean_square(timing * s.noise),
            )
        )
    ended = {window: model.why_ended(part.states[window], float(part.last[window])) for window in sorted(unreached)}
    counted = np.maximum(part.starts.seen.sum(axis=1) * 2, 1)
    shift = np.sqrt((part.standard**2 * part.starts.seen[:, :, None]).sum(axis=(1, 2)) / counted)
    return Comparison(
        recording=part.recording.name,
        model=str(part.simulator.path),
        scenario=part.simulator.scenario,
        mode="windows",
        channels=tuple(channels),
        windows=tuple(
            CompareWindow(number=k, start=float(start), stop=float(stop), shift=float(shift[k]), ended=ended.get(k, ""))
            for k, (start, stop) in enumerate(zip(part.first, part.last, strict=True))
        ),
        regimes=within(model.regimes(part.states, part.last), part.first),
        notes=notes_on(part.starts, part.unfit),
    )


def _left_out(part: Part) -> list[tuple[Channel, Samples, str]]:
    """Observed channels of the recording that took no part, their samples, and why."""
    taken = {c.name for c in part.channels}
    others = with_steady_quaternions([c for c in part.recording.with_role("observed") if c.name not in taken])
    windows = Cut(begins=part.states[:, 0], starts=part.first, stops=part.last)
    return [(c, samples_of(c, noise_of(c)[0], windows), why_unfit(c, part.recording) or NO_NOISE) for c in others]
