"""Scores of many trials in a table: what was aimed at, what was reached, by sort and strength; calibration; risk and coverage."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from rille.proof.scoring import NAMING

Line = Mapping[str, Any]
"""A :class:`~rille.proof.scoring.Score` as plain JSON."""

STRONG = 2.0  # [noise]: aims for naming hold from here on
EDGES = (0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 1.0)  # of bins of the stated probability
TITLES = {
    "one": "one effect",
    "two": "two effects",
    "outside": "outside the catalogue",
    "parameter": "a wrong number",
    "sensor": "a sensor fault",
    "nothing": "nothing",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Reached:
    """One aim. value, bound : in ``unit``; NaN: no such trials. low, high : 95 % interval of a share (Wilson 1927). n : trials."""

    what: str
    bound: float
    at_most: bool
    value: float
    unit: str
    n: int
    low: float = float("nan")
    high: float = float("nan")

    @property
    def ok(self) -> bool:
        """Whether the aim is reached."""
        return bool(self.value <= self.bound if self.at_most else self.value >= self.bound)


def aims(lines: Sequence[Line], baselines: Mapping[str, Sequence[Line]]) -> list[Reached]:
    """The aims of the proof and what was reached.

    Parameters
    ----------
    lines : scores of the diagnosis. baselines : name -> scores of the same trials.
    """
    strong = [line for line in lines if line["strength"] >= STRONG]
    one, two = _of(strong, "one"), _of(strong, "two")
    outside, nothing = _of(lines, "outside"), _of(lines, "nothing")
    placed = [line for line in _of(strong, "one") if line["target"] is not None]
    known = [line for line in strong if line["sort"] in ("one", "two", "parameter", "sensor")]
    named = [line for line in known if line["grouped"]]
    found = [
        _share("one effect, twice the floor or more: right name first", 85, one, "top"),
        _share("one effect, twice the floor or more: truth in the group named", 97, one, "grouped"),
        _share("two effects, twice the floor or more: both named", 60, two, lambda line: line["pieces"] == 1.0),
        _share("outside the catalogue: no name given", 80, outside, "abstained"),
        _share("outside the catalogue: confident wrong name", 5, outside, "confident_wrong", at_most=True),
        _share("wrong number, twice the floor or more: called so", 90, _of(strong, "parameter"), "sort_right"),
        _share("sensor fault, twice the floor or more: called so", 90, _of(strong, "sensor"), "sort_right"),
        _share("nothing concealed: a name all the same", 100 / 90, nothing, "wrong", at_most=True),
        _share(
            "one effect named, twice the floor or more: at the right joint, wheel or body", 95, placed, lambda line: line["target"] == 1.0
        ),
        _middle("amplitude off by (median of what was named, twice the floor or more)", 5, named, "error", 100.0, at_most=True),
        _middle("share of the held-out gap closed, G (median, twice the floor or more)", 0.9, named, "gap"),
        Reached(
            what="calibration error of the stated probabilities",
            bound=0.05,
            at_most=True,
            value=calibration_error(lines),
            unit="",
            n=len(_stated(lines)),
        ),
    ]
    sindy = _of([line for line in baselines.get("sindy", ()) if line["strength"] >= STRONG], "one")
    if sindy and one:
        ahead = 100 * (float(np.mean([bool(line["top"]) for line in one])) - float(np.mean([bool(line["top"]) for line in sindy])))
        found.append(Reached(what="right name first: ahead of SINDy by", bound=25, at_most=False, value=ahead, unit="points", n=len(one)))
    return found


def _of(lines: Sequence[Line], sort: str) -> list[Line]:
    return [line for line in lines if line["sort"] == sort]


def _share(what: str, bound: float, lines: Sequence[Line], word: str | Callable[[Line], bool], *, at_most: bool = False) -> Reached:
    right = [bool(line[word] if isinstance(word, str) else word(line)) for line in lines]
    low, high = wilson(sum(right), len(right))
    value = 100 * float(np.mean(right)) if right else float("nan")
    return Reached(what=what, bound=bound, at_most=at_most, value=value, unit="%", n=len(right), low=100 * low, high=100 * high)


def _middle(what: str, bound: float, lines: Sequence[Line], word: str, factor: float = 1.0, *, at_most: bool = False) -> Reached:
    values = _values(lines, word)
    value = factor * float(np.median(values)) if values else float("nan")
    return Reached(what=what, bound=bound, at_most=at_most, value=value, unit="%" if factor == 100.0 else "", n=len(values))


def _values(lines: Sequence[Line], word: str) -> list[float]:
    return [float(line[word]) for line in lines if line[word] is not None]


def wilson(right: int, n: int) -> tuple[float, float]:
    """95 % interval of a share of ``right`` out of n (Wilson 1927, J. Am. Stat. Assoc. 22)."""
    if n == 0:
        return float("nan"), float("nan")
    z, p = 1.96, right / n
    middle, half = p + z * z / (2 * n), z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return max(0.0, float((middle - half) / (1 + z * z / n))), min(1.0, float((middle + half) / (1 + z * z / n)))


def _stated(lines: Sequence[Line]) -> list[tuple[float, bool]]:
    """Stated probability of the group that was named, and whether the truth is in it."""
    return [
        (float(line["probability"]), bool(line["grouped"]))
        for line in lines
        if line["verdict"] in NAMING and line["probability"] is not None
    ]


def reliability(lines: Sequence[Line]) -> list[tuple[float, float, int]]:
    """Bins of the stated probability that hold trials: mean stated, share that was right, number."""
    stated = _stated(lines)
    found = []
    for low, high in pairwise(EDGES):
        inside = [(p, ok) for p, ok in stated if low <= p < high or (high == EDGES[-1] and p == high)]
        if inside:
            found.append((float(np.mean([p for p, _ in inside])), float(np.mean([ok for _, ok in inside])), len(inside)))
    return found


def calibration_error(lines: Sequence[Line]) -> float:
    """Mean distance of stated and true frequency over the bins, weighed by their trials (Naeini et al. 2015, AAAI); NaN without a name."""
    bins = reliability(lines)
    total = sum(n for _, _, n in bins)
    return sum(n * abs(stated - true) for stated, true, n in bins) / total if total else float("nan")


def brier(lines: Sequence[Line]) -> float:
    """Mean of (stated probability - right)^2 of named groups (Brier 1950, Monthly Weather Review 78); NaN without a name."""
    stated = _stated(lines)
    return float(np.mean([(p - ok) ** 2 for p, ok in stated])) if stated else float("nan")


def risk_coverage(lines: Sequence[Line]) -> list[tuple[float, float]]:
    """(coverage, risk): of the k surest names, as a share of all trials with something concealed, the share that is wrong."""
    stated = sorted(_stated(lines), key=lambda one: -one[0])
    total = sum(line["sort"] != "nothing" for line in lines)
    wrong = np.cumsum([not ok for _, ok in stated])
    return [((k + 1) / total, float(wrong[k]) / (k + 1)) for k in range(len(stated))] if total else []


COLUMNS = (
    "n",
    "top",
    "group",
    "pieces",
    "abstained",
    "wrong",
    "confident wrong",
    "sort",
    "target",
    "located",
    "error",
    "covered",
    "gap",
    "s",
)


def rows(lines: Sequence[Line], key: Callable[[Line], tuple]) -> list[tuple[tuple, dict[str, float]]]:
    """One row of numbers for each group of trials, in the order of their keys."""
    groups: dict[tuple, list[Line]] = {}
    for line in lines:
        groups.setdefault(key(line), []).append(line)
    return [(name, _row(groups[name])) for name in sorted(groups)]


def _row(lines: Sequence[Line]) -> dict[str, float]:
    def share(word: str) -> float:
        values = _values(lines, word)
        return 100 * float(np.mean(values)) if values else float("nan")

    def middle(word: str) -> float:
        values = _values(lines, word)
        return float(np.median(values)) if values else float("nan")

    return {
        "n": float(len(lines)),
        "top": share("top"),
        "group": share("grouped"),
        "pieces": share("pieces"),
        "abstained": share("abstained"),
        "wrong": share("wrong"),
        "confident wrong": share("confident_wrong"),
        "sort": share("sort_right"),
        "target": share("target"),
        "located": share("located"),
        "error": 100 * middle("error"),
        "covered": share("covered"),
        "gap": middle("gap"),
        "s": middle("seconds"),
    }


def by_sort_and_strength(line: Line) -> tuple:
    """Key of the main table."""
    return list(TITLES).index(line["sort"]), line["strength"]


def as_json(
    lines: Sequence[Line], baselines: Mapping[str, Sequence[Line]], agreement: Mapping[str, float], real: Sequence[Line] = ()
) -> dict[str, Any]:
    """All that the table and the page show, as plain JSON values (NaN: does not apply). real : scores of trials of real recordings."""
    strong = {name: [line for line in own if line["strength"] >= STRONG] for name, own in {"rille diagnose": lines, **baselines}.items()}
    return {
        "trials": len(lines),
        "aims": [asdict(one) | {"ok": one.ok} for one in aims(lines, baselines)],
        "rows": [{"concealed": TITLES[list(TITLES)[k[0]]], "strength": k[1], **row} for k, row in rows(lines, by_sort_and_strength)],
        "machines": [{"concealed": TITLES[k[0]], "machine": k[1], **row} for k, row in rows(lines, lambda x: (x["sort"], x["machine"]))],
        "reliability": reliability(lines),
        "calibration_error": calibration_error(lines),
        "brier": brier(lines),
        "risk_coverage": risk_coverage(lines),
        "baselines": {name: {"one": _row(_of(own, "one")), "all": _row(own)} for name, own in strong.items() if own},
        "agreement": dict(agreement),
        "real": list(real),
        "scores": list(lines),
    }


def markdown(
    lines: Sequence[Line], baselines: Mapping[str, Sequence[Line]], agreement: Mapping[str, float], real: Sequence[Line] = ()
) -> str:
    """The table for people."""
    text = ["| aim | reached | 95 % | bound | trials |\n|---|--:|--:|--:|--:|\n"]
    for one in aims(lines, baselines):
        value = "-" if not np.isfinite(one.value) else f"{'' if one.ok else '**not:** '}{one.value:.3g} {one.unit}".rstrip()
        interval = f"{one.low:.0f} to {one.high:.0f}" if np.isfinite(one.low) else ""
        text.append(f"| {one.what} | {value} | {interval} | {'<=' if one.at_most else '>='} {one.bound:.3g} | {one.n} |\n")
    text.append("\n| concealed | strength | " + " | ".join(COLUMNS) + " |\n|---|--:" + "|--:" * len(COLUMNS) + "|\n")
    for (sort, strength), row in rows(lines, by_sort_and_strength):
        text.append(f"| {TITLES[list(TITLES)[sort]]} | {strength:g} | " + " | ".join(_cell(c, row[c]) for c in COLUMNS) + " |\n")
    if baselines:
        text.append(
            "\n| baseline | right name first, one effect, twice the floor or more | G (median) | wrong names % |\n|---|--:|--:|--:|\n"
        )
        for name, own in {"rille diagnose": lines, **baselines}.items():
            strong = [line for line in own if line["strength"] >= STRONG]
            row = _row(_of(strong, "one"))
            text.append(f"| {name} | {row['top']:.0f} % | {_cell('gap', _row(strong)['gap'])} | {_row(own)['wrong']:.0f} |\n")
    if agreement:
        text.append("\n| machine | generator and solver differ by (nothing concealed, RMS over the noise of the sensors) |\n|---|--:|\n")
        text += [f"| {name} | {value:.2g} |\n" for name, value in sorted(agreement.items())]
    if real:
        text.append("\n| real recordings | concealed | found | named | held-out gap closed |\n|---|--:|--:|--:|--:|\n")
        text += [
            f"| {one['title']} | {one['of']} | {one['right']} | {one['said']} | {_cell('gap', _number(one['gap']))} |\n" for one in real
        ]
    return "".join(text)


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _cell(column: str, value: float) -> str:
    if not np.isfinite(value):
        return ""
    return f"{value:.2f}" if column == "gap" else f"{value:.1f}" if column == "error" else f"{value:.0f}"
