"""Where a model differs: over time, at which part, on the map."""

from collections.abc import Sequence

from rille.model import Rover, Terrain
from rille.model.comparison import Comparison
from rille.model.diagnosis import Diagnosis, Transient
from rille.model.difference import Difference
from rille.view.diagnosis_machine import accused_picture
from rille.view.diagnosis_map import place_map
from rille.view.diagnosis_time import time_line
from rille.view.page import Cell, Column, Section, badge, escaped, table
from rille.view.traced import percent_at, traced, value_at, with_error

SHOWN = 12  # targets and transients before "all rows"
WORDS = {
    "everywhere": "all the time",
    "transient": "in short spans only",
    "place": "at a place on the ground",
    "regime": "under certain conditions",
    "nowhere": "nowhere beyond the noise",
}


def where_section(
    diagnosis: Diagnosis,
    difference: Difference | None,
    comparisons: Sequence[Comparison],
    rover: Rover | None,
    terrain: Terrain | None,
) -> Section:
    """Time line with the marked windows, the machine with its part lit, the map, targets and transients in numbers."""
    place = diagnosis.location
    parts = [_regimes(place.regimes)]
    parts.append(time_line(diagnosis, difference))
    picture, notes = accused_picture(diagnosis, difference, comparisons, rover)
    shown_map = place_map(diagnosis, difference, comparisons, terrain)
    if picture and shown_map:
        parts.append(f'<div class="columns"><div>{picture}</div><div>{shown_map}</div></div>')
    else:
        parts.append(picture + shown_map)
    parts += [f'<p class="shown">{escaped(note)}</p>' for note in notes]
    if place.targets:
        parts.append(_targets(diagnosis))
    if diagnosis.transients:
        parts.append(_transients(diagnosis.transients))
    lead = place.sentence or f"The model differs {WORDS[place.shape]}."
    return Section(key="where", title="Where", lead=lead, body="".join(parts))


def _regimes(regimes: Sequence[str]) -> str:
    said = "".join(f"<li>{traced(sentence, f'location.regimes[{k}]')}</li>" for k, sentence in enumerate(regimes))
    return f'<ul class="points">{said}</ul>' if said else ""


def _targets(diagnosis: Diagnosis) -> str:
    columns = (
        Column(title="part"),
        Column(title="is a"),
        Column(title="share", numeric=True, hint="part of all that is beyond the noise"),
        Column(title="residual / noise", numeric=True),
        Column(title="", hint="beyond chance, or not"),
    )
    rows = [
        [
            target.name,
            target.kind,
            Cell(text=percent_at(target.share, f"location.targets[{k}].share"), value=target.share),
            Cell(text=value_at(target.size, f"location.targets[{k}].size"), value=target.size),
            badge("differs", "bad") if target.differs else badge("as simulated", "good"),
        ]
        for k, target in enumerate(diagnosis.location.targets)
    ]
    return table(columns, rows, key="target-table", shown=SHOWN, caption="Parts by what is beyond the noise")


def _transients(transients: Sequence[Transient]) -> str:
    columns = (
        Column(title="short push"),
        Column(title="at"),
        Column(title="recording"),
        Column(title="start [s]", numeric=True),
        Column(title="duration [s]", numeric=True),
        Column(title="amplitude", numeric=True, hint="with its standard error; N of a force, N m of a torque"),
        Column(title="score", numeric=True, hint="standard errors above what the calibration runs show"),
        Column(title="probability", numeric=True),
    )
    rows = [
        [
            pulse.component,
            pulse.target,
            pulse.recording,
            Cell(text=value_at(pulse.start, f"transients[{k}].start", 4), value=pulse.start),
            Cell(text=value_at(pulse.duration, f"transients[{k}].duration"), value=pulse.duration),
            Cell(text=traced(with_error(pulse.amplitude, pulse.amplitude_error), f"transients[{k}].amplitude"), value=abs(pulse.amplitude)),
            Cell(text=value_at(pulse.score, f"transients[{k}].score"), value=pulse.score),
            Cell(text=percent_at(pulse.probability, f"transients[{k}].probability"), value=pulse.probability),
        ]
        for k, pulse in enumerate(transients)
    ]
    return table(columns, rows, key="transient-table", shown=SHOWN, caption="Short pushes")
