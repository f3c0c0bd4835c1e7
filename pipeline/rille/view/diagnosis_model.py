"""The better model: equations, numbers with intervals, sources, and what changes in the database."""

import math
from collections.abc import Sequence

from rille.model.diagnosis import Diagnosis, Estimate, NamedTerm
from rille.model.finding import RowChange
from rille.view.diagnosis_what import CAUSES
from rille.view.page import Cell, Column, Html, Section, badge, escaped, number, table
from rille.view.traced import interval, traced, value_at

TIED = 0.95  # correlation above which numbers are not told apart


def model_section(diagnosis: Diagnosis, changes: Sequence[RowChange], finding: str) -> Section | None:
    """Terms of the answer and the rows that change; None if nothing was named."""
    answer = diagnosis.ranked[0].terms if diagnosis.ranked and (diagnosis.setting or diagnosis.verdict == "sensor_fault") else ()
    if not answer:
        return None
    body = "".join(_term(term, k) for k, term in enumerate(answer))
    if changes:
        body += _changes(changes)
        name = escaped(finding or "diagnosis-1")
        body += f"<pre class='command'>rille apply {escaped(diagnosis.model)} {name} -o improved.db</pre>"
    elif not diagnosis.setting:
        body += '<p class="shown">A sensor fault is corrected in the manifest of the recording; the model stays as it is.</p>'
    return Section(key="model", title="The model", lead="What the solver runs from now on, with 95 % intervals.", body=body)


def _term(term: NamedTerm, k: int) -> str:
    hypothesis = term.term.hypothesis
    law = f'<p class="law">{escaped(term.equation)}</p>' if term.equation else ""
    said = [escaped(term.meaning)] if term.meaning else []
    if math.isfinite(term.start) or math.isfinite(term.stop):
        said.append(escaped(f"acts from {number(term.start)} s to {number(term.stop)} s"))
    if hypothesis.passive:
        said.append("can only take energy out")
    if hypothesis.moves:
        said.append("moves " + ", ".join(f"<code>{escaped(name)}</code>" for _, name, _ in hypothesis.moves))
    if term.source:
        said.append(f"source: {escaped(term.source)}")
    return (
        f'<div class="card"><h3>{escaped(hypothesis.title)} {badge(*CAUSES[hypothesis.cause])}</h3>{law}'
        f'<p class="shown">{"; ".join(said)}</p>{_estimates(term, f"ranked[0].terms[{k}]", k)}</div>'
    )


def _estimates(term: NamedTerm, place: str, k: int) -> str:
    estimates = term.estimates
    now = {n.name: n.absent for n in term.term.hypothesis.free if n.amplitude} if term.term.hypothesis.cause == "parameter" else {}
    if not estimates:
        return ""
    columns = (
        Column(title="parameter"),
        Column(title="value", numeric=True),
        Column(title="95 % interval", numeric=True),
        Column(title="unit"),
        Column(title="", hint="the interval on the axis from 0; red: the value that the model has now"),
        Column(title="remarks"),
    )
    rows = [
        [
            estimate.name,
            Cell(text=Html(f"<b>{value_at(estimate.value, f'{place}.estimates[{n}].value')}</b>"), value=estimate.value),
            Cell(text=traced(interval(estimate.low, estimate.high, estimate.value), f"{place}.estimates[{n}].low"), value=estimate.low),
            "" if estimate.unit == "1" else estimate.unit,
            _whisker(estimate, now.get(estimate.name, math.nan)),
            _remarks(estimate),
        ]
        for n, estimate in enumerate(estimates)
    ]
    return table(columns, rows, key=f"parameter-table-{k}")


def _whisker(estimate: Estimate, now: float) -> Html:
    """The interval as a line on the axis from 0, and the value that the model has now, NaN: none."""
    ends = [0.0, estimate.low, estimate.high, estimate.value, *([now] if math.isfinite(now) else [])]
    if not all(math.isfinite(end) for end in ends) or max(ends) == min(ends):
        return Html("")
    left, wide = min(ends), max(ends) - min(ends)

    def at(value: float) -> float:
        return 4 + 192 * (value - left) / wide

    low, high, value, zero = (at(v) for v in (estimate.low, estimate.high, estimate.value, 0.0))
    mark = f'<line x1="{at(now):.1f}" x2="{at(now):.1f}" y1="2" y2="14" class="now"/>' if math.isfinite(now) else ""
    return Html(
        f'<svg class="whisker" viewBox="0 0 200 16" aria-hidden="true"><line x1="4" x2="196" y1="8" y2="8" class="axis"/>'
        f'<line x1="{zero:.1f}" x2="{zero:.1f}" y1="3" y2="13" class="axis"/>'
        f'<line x1="{low:.1f}" x2="{high:.1f}" y1="8" y2="8" class="range"/>{mark}<circle cx="{value:.1f}" cy="8" r="4"/></svg>'
    )


def _remarks(estimate: Estimate) -> Html:
    said = []
    if estimate.at_bound:
        said.append(badge(f"at its {estimate.at_bound} bound", "bad"))
    if abs(estimate.conditioning) >= TIED:
        said.append(badge("tied to another number", "notice"))
    if estimate.low <= 0 <= estimate.high:
        said.append(badge("zero is not excluded", "notice"))
    return Html(" ".join(said))


def _changes(changes: Sequence[RowChange]) -> str:
    columns = (
        Column(title="table"),
        Column(title="row"),
        Column(title="column"),
        Column(title="before", numeric=True),
        Column(title="after", numeric=True),
        Column(title="unit"),
        Column(title=""),
    )
    rows = [
        [
            change.table,
            change.row,
            change.column,
            Cell(text="-" if change.before is None else number(change.before, 4), value=change.before),
            Cell(text=number(change.after, 4), value=change.after),
            "" if change.unit in ("1", "-") else change.unit,
            badge("new", "good") if change.before is None else _relative(change.before, change.after),
        ]
        for change in changes
    ]
    return table(columns, rows, key="change-table", caption="What changes in the database")


def _relative(before: float, after: float) -> Html:
    return Html(f"{100 * (after / before - 1):+.3g} %") if before else Html("")
