"""HTML page of a study: sensitivity, maps, all cases as parallel lines, envelopes, numbers, what failed."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from rille.model.study import Bands, Indices, StudyTable
from rille.view.page import Cell, Column, Page, Section, figure, number, packed, table, write_page
from rille.view.study_words import factor_axis, label, order_of, outcome_axis, part_of, scale, strongest

PARALLEL = 8  # axes of the parallel lines at most
SHOWN = 40  # rows of the table of cases at first
ROWS = 2000  # of it in all: a browser shows no 100 000


def write_study_report(
    path: Path,
    study: StudyTable,
    results: Mapping[str, Indices | None],
    envelopes: Sequence[Bands],
    counts: Mapping[str, int],
    reasons: Sequence[tuple[str, str, int, int]],
) -> Path:
    """Write the page.

    Parameters
    ----------
    results : indices by outcome. envelopes : of traced channels. counts : how many cases ended how. reasons : status, reason, how many,
        first case.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    plan = study.plan
    whole, run, out = int(study.whole.sum()), int((~study.waiting).sum()), study.failed
    part = part_of(study)
    sections = [
        Section(key="outcomes", title="Outcomes", body=_outcomes(study, results), lead="Numbers over the cases that went as planned."),
        *_sensitivity(study, results),
        Section(key="maps", title="Maps", body=_maps(study, results), lead="Each outcome over the two factors that move it most."),
        Section(key="cases", title="All cases", body=_parallel(study, results), lead="Drag along an axis to choose cases."),
        *_envelopes(envelopes),
        *_failures(reasons),
        Section(key="table", title="Table", body=_cases(study), lead=_lead(study)),
    ]
    return write_page(
        path,
        Page(
            title=f"Study {plan.name}",
            subtitle=f"{len(study.status)} cases of {plan.model_file} in which {len(plan.factors)} factors vary",
            verdict=(f"All of this is {part}. " if part else "") + f"{whole} of {run} cases went as planned." + _verdict(study, results),
            tone="notice" if out.any() or part else "good",
            facts={
                "design": plan.design.replace("_", " ") + (f", {plan.samples} base samples" if plan.samples else ""),
                "seed": str(plan.seed),
                "cases": ", ".join(f"{count} {status.replace('_', ' ')}" for status, count in counts.items()),
                "model": plan.model_file,
                "rille": plan.version,
            },
            sections=[section for section in sections if section.body],
        ),
    )


def _verdict(study: StudyTable, results: Mapping[str, Indices | None]) -> str:
    """The first outcome that something moves, and what moves it; nothing where nothing does."""
    for name, one in results.items():
        if one is None or not (best := one.movers(1)):
            continue
        much = one.strength[best[0]]
        share = f"{100 * much:.0f} % of its variance" if one.are_shares else f"index {much:.2f}, no share of variance"
        return f" {label(name).capitalize()} is moved most by {label(study.plan.factors[best[0]].name)} ({share})."
    return ""


def _outcomes(study: StudyTable, results: Mapping[str, Indices | None]) -> str:
    titles = ("5 %", "median", "mean", "95 %", "standard deviation")
    columns = [Column(title="outcome"), Column(title="unit"), *(Column(title=t, numeric=True) for t in titles), Column(title="moved by")]
    lines: list[list[str | Cell]] = []
    main = {measure.name for measure in study.main_measures()}
    for measure in sorted(study.plan.measures, key=lambda m: m.name not in main):
        values, title = outcome_axis(study, measure)
        values = values[np.isfinite(values)]
        if len(values) == 0:
            continue
        low, median, high = np.quantile(values, [0.05, 0.5, 0.95])
        numbers = (low, median, values.mean(), high, values.std(ddof=1) if len(values) > 1 else 0.0)
        one = results.get(measure.name)
        by = ", ".join(label(study.plan.factors[k].name) for k in one.movers(2)) if one is not None else ""
        unit = title.rpartition("[")[2].rstrip("]") if "[" in title else ""
        name = Cell(text=label(measure.name), hint=measure.meaning)
        lines.append([name, unit, *(Cell(text=number(float(v)), value=float(v)) for v in numbers), by])
    return table(columns, lines, key="outcomes-table", shown=max(12, len(main)))


def _sensitivity(study: StudyTable, results: Mapping[str, Indices | None]) -> list[Section]:
    order = order_of(study, results)
    names = [label(study.plan.factors[k].name) for k in order]
    body, methods = "", []
    for outcome, one in results.items():
        if one is None:
            continue
        methods.append(one.method)
        traces: list[dict[str, object]] = []
        for title, share, spread, color in (
            ("with others (total)", one.total, one.total_confidence, "var(--measured)"),
            ("alone (first order)", one.first, one.first_confidence, "var(--simulated)"),
        ):
            if share is None:
                continue
            bars: dict[str, object] = {"type": "bar", "orientation": "h", "name": title, "y": names, "x": share[order].tolist()}
            bars["marker"] = {"color": color}
            if spread is not None:
                bars["error_x"] = {"type": "data", "array": spread[order].tolist(), "thickness": 1, "width": 3}
            traces.append(bars)
        left_out = f", {one.dropped} cases left out" if one.dropped else ""
        layout = {
            "barmode": "group",
            "xaxis": {"title": {"text": "share of the variance" if one.are_shares else "index"}},
            "yaxis": {"autorange": "reversed", "automargin": True},
            "legend": {"traceorder": "reversed"},
        }
        caption = f"{label(outcome)}: {one.used} cases{left_out}."
        body += figure(f"indices-{outcome}", traces, layout, caption=caption, height=130 + 46 * len(order))
    lead = "; ".join(dict.fromkeys(methods)) + ". Thin lines: 95 %." if methods else ""
    return [Section(key="sensitivity", title="Which factor moves what", body=body, lead=lead)]


def _maps(study: StudyTable, results: Mapping[str, Indices | None]) -> str:
    if len(study.plan.factors) < 2:
        return ""
    order, out, body = order_of(study, results), study.failed, ""
    for measure in study.main_measures():
        i, j = strongest(results.get(measure.name), 2, order)
        (x, x_title), (y, y_title), (z, title) = factor_axis(study, i), factor_axis(study, j), outcome_axis(study, measure)
        known = np.isfinite(z)
        if not known.any():
            continue
        points: dict[str, object] = {
            "type": "scattergl",
            "mode": "markers",
            "name": "as planned",
            "x": packed(x[known]),
            "y": packed(y[known]),
        }
        points["marker"] = {"color": packed(z[known]), "colorscale": "Viridis", "size": 7, "showscale": True, "colorbar": {"thickness": 12}}
        points["text"] = [f"case {k}: {number(v)}" for k, v in zip(np.flatnonzero(known), z[known], strict=True)]
        traces = [points]
        if out.any():
            words = [f"case {k}: {study.status[k]}" for k in np.flatnonzero(out)]
            cross = {"symbol": "x", "size": 7, "color": "var(--bad)"}
            traces.append({"type": "scattergl", "mode": "markers", "name": "not as planned", "x": packed(x[out]), "y": packed(y[out])})
            traces[-1] |= {"marker": cross, "text": words}
        layout = {
            "showlegend": False,
            **{
                axis: {"title": {"text": text}, "type": "log" if study.plan.factors[k].spread == "log" else "linear"}
                for axis, text, k in (("xaxis", x_title, i), ("yaxis", y_title, j))
            },
        }
        body += figure(f"map-{measure.name}", traces, layout, caption=title)
    return body


def _parallel(study: StudyTable, results: Mapping[str, Indices | None]) -> str:
    main = [m for m in study.main_measures() if np.isfinite(study.outcome(m.name)).any()]
    if not main or not study.whole.any():
        return ""
    whole = study.whole
    axes = [factor_axis(study, k) for k in order_of(study, results)[: PARALLEL - 2]]
    axes += [outcome_axis(study, measure) for measure in main[: max(2, PARALLEL - len(axes))]]
    color, title = outcome_axis(study, main[0])
    lines = {
        "type": "parcoords",
        "line": {"color": packed(color[whole]), "colorscale": "Viridis", "showscale": True, "colorbar": {"thickness": 12}},
        "dimensions": [{"label": text, "values": packed(values[whole])} for values, text in axes],
        "labelangle": -12,
        "labelside": "top",
    }
    layout = {"margin": {"l": 70, "r": 50, "t": 90, "b": 30}}
    return figure("parallel", [lines], layout, caption=f"A line is a case; colour: {title}.", height=420)


def _envelopes(envelopes: Sequence[Bands]) -> list[Section]:
    body = ""
    for one in envelopes:
        if not np.isfinite(one.values).any():
            continue
        by, unit = scale(one.channel.unit, float(np.nanmax(np.abs(one.values))))
        time = packed(one.time)
        traces: list[dict[str, object]] = []
        for low, high, words, shade in ((0, 4, "9 of 10 cases", 0.15), (1, 3, "half of them", 0.3)):
            edge = {"x": time, "mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
            traces.append(edge | {"y": packed(by * one.values[low]), "showlegend": False})
            traces.append(
                edge | {"y": packed(by * one.values[high]), "fill": "tonexty", "fillcolor": f"rgba(27,108,168,{shade})", "name": words}
            )
        traces.append({"x": time, "y": packed(by * one.values[2]), "mode": "lines", "line": {"color": "#1b6ca8"}, "name": "median"})
        layout = {"xaxis": {"title": {"text": "time [s]"}}, "yaxis": {"title": {"text": unit if unit != "-" else ""}}}
        body += figure(f"band-{one.channel.name}", traces, layout, caption=f"{label(one.channel.name)}: {one.cases} cases.")
    return [Section(key="envelopes", title="Over time", body=body)]


def _failures(reasons: Sequence[tuple[str, str, int, int]]) -> list[Section]:
    columns = [Column(title="cases", numeric=True), Column(title="first", numeric=True), Column(title="ended"), Column(title="why")]
    lines: list[list[str | Cell]] = []
    for status, reason, count, first in reasons:
        ended = Cell(text=status.replace("_", " "), tone="bad")
        lines.append([Cell(text=str(count), value=count), Cell(text=str(first), value=first), ended, reason])
    body = table(columns, lines, key="failures-table", shown=20) if lines else ""
    return [Section(key="failures", title="Did not go as planned", body=body, lead="These cases count in no number above.")]


def _lead(study: StudyTable) -> str:
    all_of_it = "The study's file and --parquet hold all outcomes"
    cases = len(study.status)
    return f"{all_of_it}." if cases <= ROWS else f"The first {ROWS} of {cases} cases. {all_of_it} of all of them."


def _cases(study: StudyTable) -> str:
    columns = [Column(title="case", numeric=True), Column(title="ended")]
    values = []
    for k in range(len(study.plan.factors)):
        one, title = factor_axis(study, k)
        columns.append(Column(title=title, numeric=True))
        values.append(one)
    for measure in study.main_measures():
        one, title = outcome_axis(study, measure)
        columns.append(Column(title=title, numeric=True, hint=measure.meaning))
        values.append(one)
    lines: list[list[str | Cell]] = []
    out = study.failed
    for n, status in enumerate(study.status[:ROWS]):
        ended = Cell(text=status.replace("_", " "), tone="bad" if out[n] else "")
        lines.append([Cell(text=str(n), value=n), ended, *(Cell(text=number(float(v[n])), value=float(v[n])) for v in values)])
    return table(columns, lines, key="cases-table", shown=SHOWN)
