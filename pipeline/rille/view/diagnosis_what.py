"""What is wrong: hypotheses in their order, and those that the recordings cannot tell apart."""

import math

from rille.model.diagnosis import Diagnosis, Group, RankedHypothesis
from rille.view.page import Cell, Column, Html, Section, Tone, badge, escaped, table
from rille.view.traced import percent, percent_at, traced, value_at, with_error

SHOWN = 8
CAUSES: dict[str, tuple[str, Tone]] = {
    "effect": ("missing physics", "bad"),
    "parameter": ("wrong number", "notice"),
    "sensor": ("sensor fault", ""),
}


def what_section(diagnosis: Diagnosis) -> Section:
    """Ranked hypotheses with their probabilities, groups, and why each loses."""
    best = diagnosis.ranked[0].group if diagnosis.ranked else 0
    body = "".join(_group(g, k) for k, g in enumerate(diagnosis.groups) if best and g.number == best and len(g.members) > 1)
    if diagnosis.ranked:
        body += _table(diagnosis)
    if diagnosis.unknown_like:
        body += f"<p>What is missing behaves like <code>{traced(diagnosis.unknown_like, 'unknown_like')}</code>.</p>"
    if not body:
        body = '<p class="shown">No hypothesis was tried: nothing differs beyond the noise, or the recordings cannot tell.</p>'
    lead = (
        ""
        if not diagnosis.ranked
        else (
            "Every law of the catalogue, every number of the model and every sensor that could be at fault, "
            "by how well it predicts windows that it was not fitted to."
        )
    )
    return Section(key="what", title="What", lead=lead, body=body)


def _group(group: Group, k: int) -> str:
    listed = "".join(f"<li>{escaped(member)}</li>" for member in group.members)
    place = f"groups[{k}]"
    return (
        f'<div class="card notice"><h3>Not told apart <span class="big">{percent_at(group.probability, f"{place}.probability")}</span></h3>'
        f'<ul class="points">{listed}</ul><p>{escaped(group.sentence)} '
        f'<span class="shown">Their signatures correlate by {value_at(group.correlation, f"{place}.correlation", 2)}.</span></p></div>'
    )


def _table(diagnosis: Diagnosis) -> str:
    columns = (
        Column(title="hypothesis, and why it loses"),
        Column(title="probability", numeric=True, hint="calibrated on trials whose answer was known"),
        Column(title="is"),
        Column(title="explains", numeric=True, hint="share of what is beyond the noise that it takes away"),
        Column(
            title="gain [nats]", numeric=True, hint="log-likelihood of held-out windows above the present model, with its standard error"
        ),
        Column(title="behind the best [nats]", numeric=True, hint="with its standard error; within two of them it is not told apart"),
        Column(title="group", hint="hypotheses of one group cannot be told apart by these recordings"),
    )
    rows = [_row(ranked, k, diagnosis) for k, ranked in enumerate(diagnosis.ranked)]
    return table(columns, rows, key="hypothesis-table", shown=SHOWN)


def _row(ranked: RankedHypothesis, k: int, diagnosis: Diagnosis) -> list[str | Cell]:
    place = f"ranked[{k}]"
    best = k == 0 and bool(diagnosis.setting or diagnosis.verdict == "sensor_fault")
    first = "likeliest of its group" if diagnosis.verdict == "group" else "the answer"
    said = ranked.loses_because or (first if best else "not accepted: too little is gained" if k == 0 else "")
    title = f"<b>{escaped(ranked.title)}</b>" if best else escaped(ranked.title)
    behind = with_error(ranked.behind, ranked.behind_error) if k else ""
    return [
        Html(title + (f"<small>{escaped(said)}</small>" if said else "")),
        Cell(text=probability_bar(ranked.probability, f"{place}.probability", best=best), value=ranked.probability),
        badge(*CAUSES[ranked.cause]),
        Cell(text=percent_at(ranked.explained, f"{place}.explained"), value=ranked.explained),
        Cell(text=traced(with_error(ranked.gain, ranked.gain_error), f"{place}.gain"), value=ranked.gain),
        Cell(text=traced(behind, f"{place}.behind") if behind else "", value=ranked.behind),
        badge(f"group {ranked.group}", "notice") if ranked.group and ranked.group == diagnosis.ranked[0].group else "",
    ]


def probability_bar(probability: float, place: str, *, best: bool) -> Html:
    """A bar as long as the probability, with the number."""
    part = 100 * min(max(probability, 0.0), 1.0) if math.isfinite(probability) else 0.0
    return Html(
        f'<span class="bar" style="--part:{part:.1f}%;--fill:var(--{"accent" if best else "muted"})"><i></i>'
        f"{traced(percent(probability), place)}</span>"
    )
