"""HTML page of sealed trials: what was aimed at and reached, by sort and strength, calibration, baselines, every failure."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rille.view.page import Cell, Column, Html, Page, Section, figure, number, table, write_page

HINTS = {
    "n": "trials",
    "top": "the best answer is the truth and nothing else [%]",
    "group": "the truth is in the group of the best [%]",
    "pieces": "share of the concealed things that were named [%]",
    "abstained": "no name was given [%]",
    "wrong": "a name was given and the truth is not in its group [%]",
    "confident wrong": "wrong, with a stated probability of 80 % or more [%]",
    "sort": "called what it is: missing physics, number, sensor, nothing [%]",
    "target": "the best answer's joint, wheel or body is right [%]",
    "located": "the place of the truth is among the three that differ most [%]",
    "error": "of the amplitudes, relative, median [%]",
    "covered": "amplitudes within their 95 % intervals [%]",
    "gap": "share of the held-out gap to the noise floor that is closed, median",
    "s": "seconds of a diagnosis, median",
}


def write_proof_report(path: Path, numbers: Mapping[str, Any], *, facts: Mapping[str, str]) -> Path:
    """Write the page.

    Parameters
    ----------
    numbers : of ``rille.proof.summary.as_json``. facts : name -> value, for the head: beacon, Merkle root, version.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    aims = numbers["aims"]
    reached = sum(bool(one["ok"]) for one in aims)
    return write_page(
        path,
        Page(
            title="Sealed trials",
            subtitle="What diagnosis names in recordings of an independent generator in which something is concealed",
            verdict=f"{numbers['trials']} trials; {reached} of {len(aims)} aims are reached.",
            tone="good" if reached == len(aims) else "notice",
            facts=facts,
            sections=[
                Section(key="aims", title="Aims", body=_aims(aims), lead="Every trial counts, also those that crashed or took too long."),
                Section(key="table", title="By sort and strength", body=_rows(numbers["rows"], ("concealed", "strength"), "rows")),
                Section(key="machines", title="By machine", body=_rows(numbers["machines"], ("concealed", "machine"), "machines")),
                Section(
                    key="calibration",
                    title="How sure it says it is",
                    body=_calibration(numbers),
                    lead=f"Calibration error {number(numbers['calibration_error'], 2)}, Brier score {number(numbers['brier'], 2)}.",
                ),
                Section(key="baselines", title="Against what else the field would use", body=_baselines(numbers["baselines"])),
                *_agreement(numbers["agreement"]),
                *_real(numbers["real"]),
                Section(key="trials", title="Every trial", body=_trials(numbers["scores"])),
            ],
        ),
    )


def _aims(aims: Sequence[Mapping[str, Any]]) -> str:
    columns = [Column(title="aim"), *(Column(title=t, numeric=True) for t in ("reached", "95 %", "bound", "trials")), Column(title="")]
    lines = []
    for one in aims:
        known = one["value"] == one["value"]
        interval = f"{one['low']:.0f} to {one['high']:.0f}" if one["low"] == one["low"] else ""
        word = Cell(text="reached", tone="good") if one["ok"] else Cell(text="not reached" if known else "no trials", tone="notice")
        value = f"{number(one['value'])} {one['unit']}".strip() if known else "-"
        lines.append([one["what"], value, interval, f"{'≤' if one['at_most'] else '≥'} {number(one['bound'])}", str(one["n"]), word])
    return table(columns, lines, key="aims-table")


def _rows(rows: Sequence[Mapping[str, Any]], words: Sequence[str], key: str) -> str:
    columns = [Column(title=word) for word in words] + [Column(title=name, numeric=True, hint=hint) for name, hint in HINTS.items()]
    lines = []
    for row in rows:
        cells: list[str | Cell] = [str(row[word]) for word in words]
        for name in HINTS:
            value = row[name]
            known = value == value
            text = "" if not known else f"{value:.2f}" if name == "gap" else f"{value:.1f}" if name == "error" else f"{value:.0f}"
            cells.append(Cell(text=text, value=value if known else None))
        lines.append(cells)
    return table(columns, lines, key=f"{key}-table")


def _calibration(numbers: Mapping[str, Any]) -> str:
    bins, curve = numbers["reliability"], numbers["risk_coverage"]
    even = {"x": [0, 1], "y": [0, 1], "mode": "lines", "line": {"dash": "dot", "width": 1}, "name": "stated = true", "hoverinfo": "skip"}
    points = {
        "x": [one[0] for one in bins],
        "y": [one[1] for one in bins],
        "text": [f"{one[2]} trials" for one in bins],
        "marker": {"size": [8 + 2 * one[2] ** 0.5 for one in bins]},
        "mode": "markers+lines",
        "name": "named groups",
    }
    risk = {"x": [one[0] for one in curve], "y": [one[1] for one in curve], "mode": "lines", "line": {"shape": "hv"}, "name": "wrong"}
    return figure(
        "reliability",
        [even, points],
        {
            "xaxis": {"title": {"text": "stated probability"}, "range": [0, 1.02]},
            "yaxis": {"title": {"text": "share that was right"}, "range": [0, 1.05]},
        },
        caption="Stated probability of the named group, and how often the truth was in it (larger points: more trials).",
    ) + figure(
        "risk",
        [risk],
        {
            "xaxis": {"title": {"text": "share of trials that were named"}, "range": [0, 1]},
            "yaxis": {"title": {"text": "share of them that is wrong"}},
        },
        caption="Risk and coverage: if only the surest names were given, how many of them would be wrong.",
    )


def _baselines(baselines: Mapping[str, Mapping[str, Mapping[str, float]]]) -> str:
    columns = [Column(title="method")] + [
        Column(title=title, numeric=True)
        for title in ("right name first, one effect [%]", "right sort [%]", "wrong name, all trials [%]", "G, median")
    ]
    lines = []
    for name, own in baselines.items():
        values = (own["one"]["top"], own["all"]["sort"], own["all"]["wrong"], own["all"]["gap"])
        lines.append([name, *(Cell(text=number(v) if v == v else "-", value=v if v == v else None) for v in values)])
    return table(columns, lines, key="baselines-table", caption="Trials at twice the floor or more")


def _agreement(agreement: Mapping[str, float]) -> list[Section]:
    """Generator against solver on the machines of the trials; none if all trials are of real recordings."""
    if not agreement:
        return []
    columns = [Column(title="machine"), Column(title="root mean square difference [noise]", numeric=True)]
    lines: list[list[str | Cell]] = [[name, Cell(text=number(value), value=value)] for name, value in agreement.items()]
    body = table(columns, lines, key="agreement-table")
    lead = "With nothing concealed the two must agree, else trials would only test their difference."
    return [Section(key="agreement", title="Generator against solver", body=body, lead=lead)]


def _real(scores: Sequence[Mapping[str, Any]]) -> list[Section]:
    """Trials of real recordings, if there are any."""
    if not scores:
        return []
    titles = ("concealed", "found", "named", "held-out gap closed", "peaks off by [s]", "height / truth", "s")
    columns = [Column(title="recordings"), *(Column(title=title, numeric=True) for title in titles), Column(title="answer")]
    lines: list[list[str | Cell]] = []
    for one in scores:
        numbers = [one.get(word) for word in ("of", "right", "said", "gap", "time_error", "amplitude_ratio", "seconds")]
        cells = [Cell(text=number(value) if value is not None else "", value=value) for value in numbers]
        lines.append([one["title"], *cells, one["answer"] or one["verdict"].replace("_", " ") or one["status"]])
    lead = "Real hardware; what disturbed it, or what its model lacks, is known from elsewhere and was kept away from diagnosis."
    return [Section(key="real", title="Real recordings", body=table(columns, lines, key="real-table"), lead=lead)]


def _trials(scores: Sequence[Mapping[str, Any]]) -> str:
    titles = (("trial", True), ("machine", False), ("strength", True), ("concealed", False), ("answer", False), ("", False), ("s", True))
    columns = [Column(title=title, numeric=numeric) for title, numeric in titles]
    lines = []
    for score in sorted(scores, key=_badness):
        answer = score["answer"] or score["verdict"].replace("_", " ") or score["status"]
        p = score["probability"]
        said = f"{answer} ({100 * p:.0f} %)" if p is not None else answer
        lines.append(
            [
                Cell(text=str(score["trial"]), value=score["trial"]),
                score["machine"],
                Cell(text=f"{score['strength']:g}", value=score["strength"]),
                score["truth"],
                said,
                _word(score),
                Cell(text=f"{score['seconds']:.0f}" if score["seconds"] is not None else "", value=score["seconds"]),
            ]
        )
    return table(columns, lines, key="trials-table", shown=60, caption=Html("Failures first"))


def _badness(score: Mapping[str, Any]) -> tuple:
    return score["status"] == "done", not score["confident_wrong"], not score["wrong"], score["grouped"], -score["strength"], score["trial"]


def _word(score: Mapping[str, Any]) -> Cell:
    if score["status"] != "done":
        return Cell(text=score["status"], tone="bad")
    if score["wrong"]:
        return Cell(text="wrong name", tone="bad")
    if score["top"]:
        return Cell(text="right", tone="good")
    return Cell(text="in the group", tone="good") if score["grouped"] else Cell(text="no name", tone="quiet")
