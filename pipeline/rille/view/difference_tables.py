"""Tables of the difference report."""

import math
from collections.abc import Mapping, Sequence

from rille.model.bench_curve import conditions_of, curve_label, sweep_of
from rille.model.comparison import Comparison
from rille.model.difference import VERDICTS, ChannelDifference, Difference
from rille.model.recording import GateFinding
from rille.view.difference_plots import regime_unit
from rille.view.page import Cell, Column, Html, Tone, badge, escaped, number, power_of_ten, probability, table

WINDOWS = 300  # rows of the tables at most
REGIMES = 200
RUNS = 3_000
NOTES = 60


def channel_table(difference: Difference) -> str:
    """One row per channel; key ``channel:INDEX``."""
    columns = (
        Column(title="channel", hint="name in the recording, and what it measures"),
        Column(title="verdict", hint="what the residual looks like"),
        Column(title="RMS / noise", numeric=True, hint="1 is the noise floor; the bar is logarithmic"),
        Column(title="RMS", numeric=True, hint="of measured - simulated, with its 95 % interval"),
        Column(title="noise", numeric=True, hint="1 sigma, and where it is from"),
        Column(title="bias", numeric=True, hint="mean of the residual, with its standard error"),
        Column(title="delay [ms]", numeric=True, hint="positive: the measurement comes later than the simulation"),
        Column(title="gain", numeric=True, hint="measured over simulated"),
        Column(title="lag-1", numeric=True, hint="correlation of neighbouring residuals"),
        Column(title="q", numeric=True, hint="probability of so much by chance, corrected for the number of channels"),
        Column(title="n", numeric=True, hint="samples"),
    )
    highest = max([10.0, *(c.normalised for c in difference.channels if math.isfinite(c.normalised))])
    keys = [f"channel:{index}" for index in range(len(difference.channels))]
    return table(columns, [_channel_row(channel, highest) for channel in difference.channels], key="channel-table", row_keys=keys)


def _channel_row(c: ChannelDifference, highest: float) -> list[Cell]:
    tone: Tone = "quiet" if c.left_out or c.verdict == "no data" else "bad" if c.differs else "good"
    lag1 = c.whiteness.lag1 if c.whiteness is not None else math.nan
    sure_delay = abs(c.lag_fit.delay) > 3 * c.lag_fit.delay_error
    sure_bias = abs(c.bias) > 3 * c.bias_error
    return [
        Cell(text=_named(c.name, f"{c.of} [{c.unit}]")),
        Cell(text=c.verdict, tone=tone, hint=c.left_out or VERDICTS[c.verdict]),
        Cell(text=_meter(c.normalised, highest, tone), value=c.normalised),
        Cell(text=number(c.rms), value=c.rms, hint=f"{number(c.rms_low)} to {number(c.rms_high)} {c.unit}"),
        Cell(text=number(c.noise), value=c.noise, hint=c.noise_from),
        Cell(text=_with_error(c.bias, c.bias_error), value=abs(c.bias), tone="notice" if sure_bias and c.differs else ""),
        Cell(
            text=_with_error(1e3 * c.lag_fit.delay, 1e3 * c.lag_fit.delay_error),
            value=abs(c.lag_fit.delay),
            tone="notice" if sure_delay and c.differs else "",
        ),
        Cell(text=_with_error(c.lag_fit.gain, max(c.lag_fit.gain_error, 1e-3)), value=abs(c.lag_fit.gain - 1)),
        Cell(text=_decimals(lag1, 2), value=lag1),
        Cell(text=probability(c.q), value=c.q),
        Cell(text=str(c.n), value=c.n),
    ]


def _meter(value: float, highest: float, tone: Tone) -> str:
    """The number over a bar that is logarithmic from half the noise to ``highest``."""
    part = 100 * math.log(max(value, 0.5) / 0.5) / math.log(highest / 0.5) if math.isfinite(value) else 0.0
    fill = {"bad": "bad-back", "good": "good-back"}.get(tone, "soft")
    return Html(f'<span class="meter" style="--part:{part:.0f}%;--fill:var(--{fill})">{number(value)}</span>')


def _named(name: str, meaning: str) -> Html:
    """A name with what it means below it."""
    return Html(f"{escaped(name)}<small>{escaped(meaning)}</small>")


def _with_error(value: float, error: float) -> str:
    """Value and error to the digits that the error allows."""
    if not (math.isfinite(value) and math.isfinite(error) and error > 0):
        return number(value)
    size = max(abs(value), error)
    if 1e-2 <= size < 1e5:
        places = min(8, max(0, 1 - math.floor(math.log10(error))))
        return f"{value:.{places}f} ± {error:.{places}f}"
    power = math.floor(math.log10(size))
    places = min(8, max(0, 1 - math.floor(math.log10(error)) + power))
    return f"({value / 10.0**power:.{places}f} ± {error / 10.0**power:.{places}f})·{power_of_ten(power)}"


def _decimals(value: float, places: int) -> str:
    return f"{round(value, places) + 0.0:.{places}f}" if math.isfinite(value) else "-"  # + 0.0: no minus before a zero


def window_table(difference: Difference, comparisons: Sequence[Comparison], kept: Mapping[str, int]) -> str:
    """Worst windows; key ``window:RECORDING:NUMBER`` where the page holds the series. Of bench points a window is a curve."""
    points = difference.mode == "points"
    curves = _curves(comparisons) if points else {}
    columns = (
        Column(title="rank", numeric=True),
        Column(title="recording"),
        Column(title="curve" if points else "window", numeric=True),
        Column(title="conditions") if points else Column(title="time [s]", numeric=True),
        Column(title="RMS / noise", numeric=True, hint="square root of chi-squared over its degrees of freedom"),
        Column(title="q", numeric=True, hint="probability of so much by chance, corrected for the number of windows"),
        Column(title="mostly in", hint="channel that exceeds its noise most, and its share of all that is beyond the noise"),
        Column(title="of"),
        Column(title="left out" if points else "ended"),
        *(() if points else (Column(title=Html("start moved [&sigma;]"), numeric=True, hint="of the fitted state from the smoothed one"),)),
    )
    shown = difference.windows[:WINDOWS]
    rows = [
        [
            Cell(text=str(w.rank), value=w.rank),
            w.recording,
            Cell(text=str(w.number), value=w.number),
            Cell(
                text=curves.get((w.recording, w.number), "-") if points else f"{_decimals(w.start, 2)} to {_decimals(w.stop, 2)}",
                value=w.start,
            ),
            Cell(text=number(w.normalised), value=w.normalised, tone="bad" if w.differs else ""),
            Cell(text=probability(w.q), value=w.q),
            f"{w.channel} ({100 * w.share:.0f} %)" if w.channel and math.isfinite(w.share) else w.channel,
            w.target,
            w.ended,
            *([] if points else [Cell(text=number(w.shift, 2), value=w.shift)]),
        ]
        for w in shown
    ]
    keys = [f"window:{kept[w.recording]}:{w.number}" if w.recording in kept else "" for w in shown]
    more = len(difference.windows) - len(shown)
    note = f'<p class="shown">{more} further windows are in the JSON.</p>' if more > 0 else ""
    return table(columns, rows, key="window-table", row_keys=keys, shown=10) + note


def _curves(comparisons: Sequence[Comparison]) -> dict[tuple[str, int], str]:
    """Conditions of every curve of bench points, by recording and number."""
    found = {}
    for comparison in comparisons:
        regimes = comparison.regimes
        conditions, sweep = conditions_of(regimes), sweep_of(regimes)
        for window in comparison.windows:
            inside = regimes.window == window.number
            if inside.any():
                along = {name: values[inside] for name, values in conditions.items()}
                found[comparison.recording, window.number] = curve_label(along, sweep)
    return found


def run_table(difference: Difference, kept: Mapping[str, int]) -> str:
    """Per recording and channel; key ``run:RECORDING:CHANNEL`` where the page holds the series."""
    numbers = {channel.name: index for index, channel in enumerate(difference.channels)}
    units = {channel.name: channel.unit for channel in difference.channels}
    columns = (
        Column(title="recording"),
        Column(title="channel"),
        Column(title="RMS / noise", numeric=True),
        Column(title="RMS", numeric=True),
        Column(title="bias", numeric=True),
        Column(title="unit"),
        Column(title="n", numeric=True),
    )
    runs = sorted(difference.runs, key=lambda run: -run.normalised if math.isfinite(run.normalised) else 0.0)[:RUNS]
    rows = [
        [
            run.recording,
            run.channel,
            Cell(text=number(run.normalised), value=run.normalised),
            Cell(text=number(run.rms), value=run.rms),
            Cell(text=number(run.bias), value=abs(run.bias)),
            units.get(run.channel, ""),
            Cell(text=str(run.n), value=run.n),
        ]
        for run in runs
    ]
    keys = [f"run:{kept[run.recording]}:{numbers[run.channel]}" if run.recording in kept and run.channel in numbers else "" for run in runs]
    return table(columns, rows, key="run-table", row_keys=keys, shown=8)


def regime_table(difference: Difference) -> str:
    """Strongest dependences; key ``regime:CHANNEL:NAME``."""
    numbers = {channel.name: index for index, channel in enumerate(difference.channels)}
    columns = (
        Column(title="channel"),
        Column(title="against"),
        Column(title="explains", numeric=True, hint="share of the residual's mean square that the bins' means take away"),
        Column(title="trend", numeric=True, hint="change of the mean of residual over noise from the lowest to the highest value"),
        Column(title="growth", numeric=True, hint="the same of its square"),
        Column(title="from", numeric=True),
        Column(title="to", numeric=True),
        Column(title="q", numeric=True, hint="probability by chance, corrected for the number of pairs"),
    )
    shown = [regime for regime in difference.regimes if regime.channel in numbers][:REGIMES]
    rows = [
        [
            r.channel,
            Html(f"{escaped(r.regime)} {badge('depends', 'notice') if r.differs else ''}"),
            Cell(text=f"{100 * r.explained:.0f} %" if math.isfinite(r.explained) else "-", value=r.explained),
            Cell(text=_with_error(r.trend, r.trend_error), value=abs(r.trend)),
            Cell(text=_with_error(r.growth, r.growth_error), value=abs(r.growth)),
            Cell(text=number(float(r.edges[0])), value=float(r.edges[0]), hint=regime_unit(r.regime)),
            Cell(text=number(float(r.edges[-1])), value=float(r.edges[-1]), hint=regime_unit(r.regime)),
            Cell(text=probability(r.q), value=r.q),
        ]
        for r in shown
    ]
    keys = [f"regime:{numbers[r.channel]}:{r.regime}" for r in shown]
    return table(columns, rows, key="regime-table", row_keys=keys, shown=8)


def target_table(difference: Difference) -> str:
    """Joints, parts, wheels and drives, worst first; key ``channel:INDEX`` of the worst channel."""
    numbers = {channel.name: index for index, channel in enumerate(difference.channels)}
    columns = (
        Column(title="target"),
        Column(title="is a"),
        Column(title="RMS / noise", numeric=True),
        Column(title="share", numeric=True, hint="part of all that is beyond the noise"),
        Column(title="channels, worst first"),
        Column(title="n", numeric=True),
    )
    rows = [
        [
            t.name,
            t.kind,
            Cell(text=number(t.normalised), value=t.normalised, tone="bad" if t.differs else "good"),
            Cell(text=f"{100 * t.share:.0f} %" if math.isfinite(t.share) else "-", value=t.share),
            ", ".join(t.channels),
            Cell(text=str(t.n), value=t.n),
        ]
        for t in difference.targets
    ]
    keys = [f"channel:{numbers[t.channels[0]]}" if t.channels and t.channels[0] in numbers else "" for t in difference.targets]
    return table(columns, rows, key="target-table", row_keys=keys, shown=12)


def findings_table(findings: Mapping[str, Sequence[GateFinding]]) -> str:
    """Findings of the data gate; those of one kind and channel in one row, with the words of the first."""
    where: dict[tuple[str, str, str], dict[str, str]] = {}
    for recording, found in findings.items():
        for finding in found:
            where.setdefault((finding.severity, finding.code, finding.channel), {}).setdefault(recording, finding.message)
    if not where:
        return '<p class="shown">Nothing was found.</p>'
    order = {"error": 0, "warning": 1, "note": 2}
    tones: dict[str, Tone] = {"error": "bad", "warning": "notice", "note": "quiet"}
    columns = (
        Column(title="severity"),
        Column(title="code"),
        Column(title="channel"),
        Column(title="finding"),
        Column(title="in"),
    )
    rows = [
        [
            Cell(text=severity, tone=tones[severity], value=order[severity]),
            code,
            channel or "all",
            next(iter(said.values())) + (f" (in {next(iter(said))}; the others alike)" if len(set(said.values())) > 1 else ""),
            Cell(text=next(iter(said)) if len(said) == 1 else f"{len(said)} recordings", hint=", ".join([*said][:20]), value=len(said)),
        ]
        for (severity, code, channel), said in sorted(where.items(), key=lambda item: order[item[0][0]])
    ]
    return table(columns, rows, key="gate-table", shown=25)


def words(difference: Difference, comparisons: Sequence[Comparison], notes: Sequence[str]) -> str:
    """What the words of the page mean, and the notes of all that made it."""
    meanings = {
        "residual": "measured - simulated, the simulation as the sensor would have seen it (rate, delay, resolution)",
        "noise": "1 sigma of the channel: stated in the manifest, or estimated from what no smooth motion explains (hover over it)",
        "RMS / noise": "1 is the noise floor: the model misses nothing that the sensor could see",
        "window": "a stretch replayed from the recorded state at its start, so that errors do not pile up over the recording",
        "q": f"below {difference.false_discovery_rate:g}: beyond chance, with the number of tests taken into account (Benjamini-Hochberg)",
        **VERDICTS,
    }
    listed = "".join(f"<dt>{escaped(word)}</dt><dd>{escaped(meaning)}</dd>" for word, meaning in meanings.items())
    said: dict[str, list[str]] = {}
    for comparison in comparisons:
        for note in comparison.notes:
            said.setdefault(note, []).append(comparison.recording)
    others = [note for note in difference.notes if not note.endswith(tuple(said))]
    lines = "".join(
        [f"<li>{escaped(note)}</li>" for note in (*notes, *others)]
        + [f"<li>{escaped(_of(names, len(comparisons)))}{escaped(note)}</li>" for note, names in list(said.items())[:NOTES]]
    )
    return f'<dl class="words">{listed}</dl>' + (f"<h3>Notes</h3><ul>{lines}</ul>" if lines else "")


def _of(names: Sequence[str], total: int) -> str:
    """Which recordings a note is about; nothing if all."""
    if len(names) == total:
        return ""
    return f"{names[0]}: " if len(names) == 1 else f"{len(names)} recordings: "
