"""Evidence of one recording as a comparison: the recording beside what its fitted starts give."""

import numpy as np
from numpy.typing import NDArray

from rille.diagnosis.comparison.compare import within
from rille.diagnosis.evidence.applied import applied, sensor_terms
from rille.diagnosis.evidence.evidence_part import Part
from rille.diagnosis.hypotheses.sensor_faults import said, true_instants
from rille.diagnosis.starts.start_fit import residuals
from rille.model.comparison import ComparedChannel, CompareWindow, Comparison
from rille.model.hypothesis import Setting

Array = NDArray[np.float64]


def comparison_of(part: Part, setting: Setting | None = None) -> Comparison:
    """The recording beside the model of a setting from the fitted starts, its sensors as faulty as the setting says, what the step does
    taken off.

    setting : None: the one under which the starts were fitted.
    """
    assumed = part.assumed if setting is None else setting
    model, faults = applied(part.simulator, assumed), sensor_terms(assumed)
    picks = [(s.window, true_instants(faults, s.channel, s.time)) for s in part.samples]
    answers = model.predict(part.states[None], part.last, [s.channel for s in part.samples], picks)
    channels, unreached = [], set()
    for s, source, error, answer in zip(part.samples, part.noise_from, part.error, answers, strict=True):
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
                start_gain=np.zeros(int(reached.sum())),
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
    )
