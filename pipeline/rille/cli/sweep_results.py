"""Results of a study as text, JSON, Parquet and figures."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model.study import Indices, Measure, StudyTable
from rille.study import bands, indices, why_none

REASONS = 5  # that are shown, the most frequent first
STRONGEST = 3  # factors that are named for an outcome


def found(table: StudyTable) -> dict[str, Indices | None]:
    """Indices of the main outcomes, by name."""
    return {measure.name: indices(table, measure.name) for measure in table.main_measures()}


def counts(table: StudyTable) -> dict[str, int]:
    """How many cases ended how, the most frequent first."""
    return dict(Counter(table.status).most_common())


def reasons(table: StudyTable) -> list[tuple[str, str, int, int]]:
    """(status, reason, how many, number of the first case) of cases that did not go as planned, whatever numbers their reasons hold."""
    groups: dict[tuple[str, str], list[int]] = {}
    for number, (status, reason) in enumerate(zip(table.status, table.reason, strict=True)):
        if reason and not table.whole[number]:
            key = " ".join("#" if any(c.isdigit() for c in word) else word for word in reason.split())
            groups.setdefault((status, key), []).append(number)
    ordered = sorted(groups.items(), key=lambda item: (-len(item[1]), item[1][0]))
    return [(status, table.reason[numbers[0]], len(numbers), numbers[0]) for (status, _), numbers in ordered]


def lines_of(table: StudyTable, results: Mapping[str, Indices | None]) -> list[str]:
    """For people."""
    plan = table.plan
    ended = ", ".join(f"{count} {status.replace('_', ' ')}" for status, count in counts(table).items())
    lines = [f"study '{plan.name}': {len(table.status)} cases of {len(plan.factors)} factors by {plan.design}; {ended}", ""]
    lines.append(f"{'outcome':<32} {'unit':<6} {'min':>10} {'median':>10} {'mean':>10} {'max':>10} {'sd':>10}   moved by")
    for measure in table.main_measures():
        lines.append(_line(table, measure, results[measure.name]))
    methods = sorted({one.method for one in results.values() if one is not None})
    lines += ["", *(f"moved by: {method}" for method in methods)]
    for status, reason, count, first in reasons(table)[:REASONS]:
        lines.append(f"{count} {status.replace('_', ' ')}, the first is case {first}: {reason}")
    return lines


def _line(table: StudyTable, measure: Measure, one: Indices | None) -> str:
    values = table.outcome(measure.name)
    values = values[np.isfinite(values)]
    title = f"{measure.name:<32} {measure.unit:<6}"
    if len(values) == 0:
        return f"{title} {'no values':>10}"
    numbers = (values.min(), np.median(values), values.mean(), values.max(), _deviation(values))
    return f"{title} " + " ".join(f"{number:10.4g}" for number in numbers) + f"   {_strongest(table, measure.name, one)}"


def _deviation(values: NDArray[np.float64]) -> float:
    """Standard deviation of what the cases are a sample of; 0 of a single one."""
    return float(values.std(ddof=1)) if len(values) > 1 else 0.0


def _strongest(table: StudyTable, outcome: str, one: Indices | None) -> str:
    if one is None:
        return why_none(table, outcome) or "-"
    return ", ".join(f"{table.plan.factors[k].name} {one.strength[k]:.2f}" for k in one.movers(STRONGEST)) or "-"


def json_of(table: StudyTable, results: Mapping[str, Indices | None]) -> dict[str, Any]:
    """For programs."""
    plan = table.plan
    names = [factor.name for factor in plan.factors]

    def numbers(values: NDArray[np.float64]) -> dict[str, float | int | None]:
        known = values[np.isfinite(values)]
        if len(known) == 0:
            return {"cases": 0}
        quantiles = np.quantile(known, [0.05, 0.5, 0.95])
        return {
            "cases": len(known),
            "min": float(known.min()),
            "mean": float(known.mean()),
            "max": float(known.max()),
            "sd": _deviation(known),
            **dict(zip(("q05", "median", "q95"), map(float, quantiles), strict=True)),
        }

    def shares(values: NDArray[np.float64] | None) -> dict[str, float | None] | None:
        if values is None:
            return None
        return {name: float(v) if math.isfinite(v) else None for name, v in zip(names, values, strict=True)}

    def of(one: Indices | None) -> dict[str, Any] | None:
        if one is None:
            return None
        fields = {key: shares(getattr(one, key)) for key in ("first", "first_confidence", "total", "total_confidence")}
        return {"method": one.method, "cases": one.used, "left_out": one.dropped, **fields, "second": _pairs(names, one.second)}

    return {
        "name": plan.name,
        "model": plan.model_file,
        "design": plan.design,
        "seed": plan.seed,
        "cases": len(table.status),
        "status": counts(table),
        "factors": [{"name": f.name, "unit": f.unit, "spread": f.spread} for f in plan.factors],
        "outcomes": [
            {"name": m.name, "unit": m.unit, "meaning": m.meaning, **numbers(table.outcome(m.name)), "indices": of(results.get(m.name))}
            for m in plan.measures
        ],
        "failures": [{"status": s, "reason": why, "cases": count, "first": first} for s, why, count, first in reasons(table)],
    }


def _pairs(names: Sequence[str], second: NDArray[np.float64] | None) -> list[dict[str, Any]] | None:
    if second is None:
        return None
    k = len(names)
    return [{"factors": [names[i], names[j]], "share": float(second[i, j])} for i in range(k) for j in range(i + 1, k)]


def write_parquet(path: Path, table: StudyTable) -> Path:
    """A row per case: number, status, reason, factors, outcomes; units stand in the columns' metadata.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    from rille.model import InputRefused

    fields = [pa.field("case", pa.int64()), pa.field("status", pa.string()), pa.field("reason", pa.string())]
    columns: list[Any] = [np.arange(len(table.status)), list(table.status), list(table.reason)]
    for described, values in ((table.plan.factors, table.values), (table.plan.measures, table.outcomes)):
        for k, one in enumerate(described):
            fields.append(pa.field(one.name, pa.float64(), metadata={"unit": one.unit}))
            columns.append(pa.array(values[:, k], from_pandas=True))  # NaN is no value
    part = path.with_name(path.name + ".part")
    try:
        pq.write_table(pa.Table.from_arrays([pa.array(c) for c in columns], schema=pa.schema(fields)), part)
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise InputRefused(f"'{path}' cannot be written: {error}; is the folder writable and the disk not full?") from None
    return path


def write_figures(
    folder: Path, table: StudyTable, results: Mapping[str, Indices | None], traces: Mapping[str, NDArray[np.float64]]
) -> list[Path]:
    """Figures and the page.

    Raises
    ------
    InputRefused : if the folder cannot be made.
    """
    from rille.model import InputRefused
    from rille.view.study_figures import draw_study
    from rille.view.study_report import write_study_report

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputRefused(f"the folder '{folder}' cannot be made: {error}") from None
    envelopes = [bands(table.plan, channel, traces[channel.name]) for channel in table.plan.traced]
    drawn = draw_study(folder, table, results, envelopes)
    return [*drawn, write_study_report(folder / "study.html", table, results, envelopes, counts(table), reasons(table))]
