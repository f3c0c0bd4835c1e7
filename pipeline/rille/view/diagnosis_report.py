"""The diagnosis report: what is wrong with a model, as one HTML page that an engineer who was not there reads in five minutes."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from rille.model import Rover, Terrain
from rille.model.comparison import Comparison
from rille.model.diagnosis import VERDICTS, Diagnosis, Experiment, Verdict
from rille.model.difference import Difference
from rille.model.finding import RowChange
from rille.view.diagnosis_fit import fit_section
from rille.view.diagnosis_model import model_section
from rille.view.diagnosis_what import what_section
from rille.view.diagnosis_where import where_section
from rille.view.page import Html, Page, Section, Tone, badge, escaped, number, write_page
from rille.view.traced import percent, percent_at, traced, value_at

TONES: dict[Verdict, Tone] = {
    "nothing_missing": "good",
    "named": "bad",
    "group": "bad",
    "parameter": "notice",
    "sensor_fault": "notice",
    "unknown": "notice",
    "cannot_know": "notice",
}
TITLES: dict[Verdict, str] = {
    "nothing_missing": "nothing is missing",
    "named": "missing physics, named",
    "group": "missing physics, named up to a group",
    "parameter": "a number of the model is wrong",
    "sensor_fault": "a sensor is wrong",
    "unknown": "something without a name",
    "cannot_know": "cannot be told",
}
LISTED = 4  # names in the head


def write_diagnosis_report(
    path: str | Path,
    diagnosis: Diagnosis,
    numbers: Mapping[str, object],
    *,
    finding: str = "",
    changes: Sequence[RowChange] = (),
    difference: Difference | None = None,
    comparisons: Sequence[Comparison] = (),
    improved: Sequence[Comparison] = (),
    rover: Rover | None = None,
    terrain: Terrain | None = None,
) -> None:
    """Write the page.

    Parameters
    ----------
    path : of the HTML file. numbers : the diagnosis as JSON; the page holds it, and every number in it says where it stands there.
    finding : name under which the database keeps it. changes : what applying it changes. difference, comparisons : of the present model,
    for the time line, the map and curves. improved : comparisons of the improved model with the same recordings. rover, terrain : for the
    pictures.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    sections = [
        where_section(diagnosis, difference, comparisons, rover, terrain),
        what_section(diagnosis),
        model_section(diagnosis, changes, finding),
        fit_section(diagnosis, comparisons, improved),
        _data_section(diagnosis),
        _next_section(diagnosis),
        _reading_section(diagnosis),
    ]
    page = Page(
        title=f"Diagnosis: {_listed(diagnosis.recordings)}",
        subtitle=f"model {Path(diagnosis.model).name}"
        + (f", scenario {diagnosis.scenario}" if diagnosis.scenario else "")
        + (f", {finding}" if finding else ""),
        verdict=_verdict(diagnosis),
        tone=TONES[diagnosis.verdict],
        facts=_facts(diagnosis),
        sections=[section for section in sections if section is not None],
        data={"diagnosis": numbers},
    )
    write_page(path, page)


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:LISTED]) + (f" and {len(names) - LISTED} more recordings" if len(names) > LISTED else "")


def _verdict(diagnosis: Diagnosis) -> Html:
    """The answer in one paragraph: what, where, how much better, what next."""
    said = [f"<b>{escaped(_sentence(diagnosis.sentence))}</b>"]
    where = diagnosis.location.sentence
    if where and where.strip(". ").lower() not in diagnosis.sentence.lower():
        said.append(escaped(_sentence(where)))
    proof = diagnosis.proof
    if proof is not None and math.isfinite(proof.gap_closed) and "gap" not in diagnosis.sentence:
        said.append(
            f"The improved model closes {percent_at(proof.gap_closed, 'proof.gap_closed')} of the gap to the noise floor "
            f"on what it has not seen ({percent_at(proof.low, 'proof.low')} to {percent_at(proof.high, 'proof.high')})."
        )
    if diagnosis.verdict in ("group", "unknown", "cannot_know") and diagnosis.experiments:
        said.append(f"To know more: {escaped(_sentence(diagnosis.experiments[0].sentence, lower=True))}")
    return Html(" ".join(said))


def _sentence(text: str, *, lower: bool = False) -> str:
    text = text.strip()
    first = text[:1].lower() if lower else text[:1].upper()
    return first + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def _facts(diagnosis: Diagnosis) -> dict[str, str]:
    facts: dict[str, str] = {"Verdict": badge(TITLES[diagnosis.verdict], TONES[diagnosis.verdict])}
    sure = next((k for k, group in enumerate(diagnosis.groups) if group.number == _best_group(diagnosis)), None)
    if diagnosis.verdict == "group" and sure is not None:
        facts["Probability of the group"] = percent_at(diagnosis.groups[sure].probability, f"groups[{sure}].probability")
    elif diagnosis.ranked and (diagnosis.setting or diagnosis.verdict == "sensor_fault"):
        facts["Probability"] = percent_at(diagnosis.ranked[0].probability, "ranked[0].probability")
    worst = next((k for k, target in enumerate(diagnosis.location.targets) if target.differs), None)
    if worst is not None:
        target = diagnosis.location.targets[worst]
        facts["Sits at"] = Html(f"{escaped(target.name)} ({percent_at(target.share, f'location.targets[{worst}].share')})")
    if diagnosis.proof is not None and math.isfinite(diagnosis.proof.gap_closed):
        proof = diagnosis.proof
        facts["Gap closed, held out"] = Html(
            f"{percent_at(proof.gap_closed, 'proof.gap_closed')} <small>[{percent(proof.low)}, {percent(proof.high)}]</small>"
        )
        facts["Residual / noise"] = Html(f"{value_at(proof.before, 'proof.before')} → {value_at(proof.after, 'proof.after')}")
    facts["Fitted to"] = _listed(diagnosis.recordings)
    facts["Held out"] = _listed(diagnosis.held_out) or "nothing"
    return facts


def _best_group(diagnosis: Diagnosis) -> int:
    return diagnosis.ranked[0].group if diagnosis.ranked else 0


def _data_section(diagnosis: Diagnosis) -> Section | None:
    """What is wrong with the recordings, and what they cannot tell."""
    if not diagnosis.data_problems and not diagnosis.limits:
        return None
    parts = []
    for title, sentences, place in (
        ("Found by the data gate, before any model", diagnosis.data_problems, "data_problems"),
        ("What these recordings cannot tell", diagnosis.limits, "limits"),
    ):
        if sentences:
            listed = "".join(f"<li>{traced(sentence, f'{place}[{k}]')}</li>" for k, sentence in enumerate(sentences))
            parts.append(f'<div><h3>{title}</h3><ul class="points">{listed}</ul></div>')
    return Section(key="data", title="Data and limits", body=f'<div class="columns">{"".join(parts)}</div>')


def _next_section(diagnosis: Diagnosis) -> Section | None:
    if not diagnosis.experiments:
        return None
    body = "".join(_experiment(experiment, k) for k, experiment in enumerate(diagnosis.experiments))
    lead = "Simulated with each of the hypotheses that are not told apart; the first separates them best."
    return Section(key="next", title="What to record next", lead=lead, body=body)


def _experiment(experiment: Experiment, k: int) -> str:
    place = f"experiments[{k}]"
    now = f", {value_at(experiment.now, f'{place}.now')} with these recordings" if math.isfinite(experiment.now) else ""
    shown = [("scenario for <code>rille run</code>", experiment.scenario), ("points to measure", experiment.points)]
    details = "".join(f"<details><summary>{what}</summary><pre>{escaped(text)}</pre></details>" for what, text in shown if text)
    return (
        f'<div class="card"><h3>{escaped(experiment.name)} <span class="shown">{escaped(experiment.purpose)}</span></h3>'
        f"<p>{escaped(experiment.sentence)}</p>"
        f'<p class="shown">Expected separation: {value_at(experiment.separation, f"{place}.separation")} sigma{now}.</p>{details}</div>'
    )


def _reading_section(diagnosis: Diagnosis) -> Section:
    """What the words mean, notes, and how long it took."""
    meanings = {
        "residual": "measured - simulated, in short windows that are replayed from the recorded state",
        "noise floor": "what the sensors' noise alone would leave; no model does better",
        "gain": "how much likelier held-out windows become, as a logarithm; accepted above two standard errors",
        "group": "hypotheses whose marks in these recordings are alike; the next experiment separates them",
        "gap closed": "G = (before - after) / (before - floor) on recordings or times that the fit has not seen",
        TITLES[diagnosis.verdict]: VERDICTS[diagnosis.verdict],
        "dotted numbers": "stand in the JSON of this diagnosis; hover to see where",
    }
    listed = "".join(f"<dt>{escaped(word)}</dt><dd>{escaped(meaning)}</dd>" for word, meaning in meanings.items())
    notes = "".join(f"<li>{escaped(note)}</li>" for note in diagnosis.notes)
    took = ", ".join(f"{escaped(stage)} {number(seconds, 2)} s" for stage, seconds in diagnosis.seconds.items())
    body = f'<dl class="words">{listed}</dl>' + (f"<h3>Notes</h3><ul>{notes}</ul>" if notes else "")
    return Section(key="reading", title="How to read this", body=body + (f'<p class="shown">It took: {took}.</p>' if took else ""))
