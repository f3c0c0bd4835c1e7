"""Does a model differ from recordings beyond their noise, where, and when? Statistics of the residuals of comparisons."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from rille.diagnosis.comparison.block_errors import adjusted
from rille.diagnosis.comparison.channel_statistics import channel_statistics
from rille.diagnosis.comparison.pooled import Pooled, pool
from rille.diagnosis.comparison.regime_table import regime_table
from rille.diagnosis.comparison.verdict import RATE, judged
from rille.diagnosis.comparison.window_rank import rank_windows
from rille.model import InputRefused
from rille.model.comparison import Comparison
from rille.model.difference import ChannelDifference, Difference, RunDifference, TargetDifference, WindowDifference
from rille.model.recording import QUANTITIES

Kind = Literal["joint", "part", "wheel", "drive"]
PLAIN = 2.0  # [noise] RMS beyond which what does not differ is no noise, but what the noise is too small for


def find_difference(comparisons: Sequence[Comparison]) -> Difference:
    """Statistics over all channels, windows, targets and regimes of comparisons of one model; recordings are pooled.

    A channel differs when q < 5 % (Benjamini-Hochberg over channels) of the smallest of five p values times five (size against the noise,
    in all and in the worst window, whiteness, bias, delay against the simulation), and what it shows is large enough
    (``verdict.LEAST_SIZE``).

    Raises
    ------
    InputRefused : if there are none, or they are of several models or modes.
    """
    if not comparisons:
        raise InputRefused("there is no comparison to make statistics of; name a recording")
    for what, values in (("models", {c.model for c in comparisons}), ("modes", {c.mode for c in comparisons})):
        if len(values) > 1:
            raise InputRefused(f"comparisons of several {what} ({', '.join(sorted(values))}) cannot be pooled; compare them one by one")
    pooled = pool(comparisons)
    rows = [channel_statistics(channel, comparisons) for channel in pooled]
    q = adjusted(np.array([row.p for row in rows]))
    rows = [judged(row, channel, float(q[k]), RATE / len(rows)) for k, (row, channel) in enumerate(zip(rows, pooled, strict=True))]
    used = [channel for channel in pooled if not channel.left_out]
    squares = sum(float(np.nansum(channel.z**2)) for channel in used)
    degrees = sum(float(np.sum(channel.degrees[np.isfinite(channel.z)])) for channel in used)
    windows = rank_windows(comparisons, pooled, RATE)
    targets = _targets(rows, pooled)
    return Difference(
        model=comparisons[0].model,
        recordings=tuple(comparison.recording for comparison in comparisons),
        mode=comparisons[0].mode,
        differs=any(row.differs for row in rows),
        sentence=_sentence(rows, targets, windows),
        chi2_per_degree=squares / degrees if degrees > 0 else float("nan"),
        channels=tuple(rows),
        windows=windows,
        targets=targets,
        regimes=regime_table(comparisons, pooled, RATE),
        runs=_runs(comparisons, pooled),
        notes=_notes(comparisons),
        false_discovery_rate=RATE,
    )


def _notes(comparisons: Sequence[Comparison]) -> tuple[str, ...]:
    """Every note once, with the first recording that has it and the number of the others."""
    where: dict[str, list[str]] = {}
    for comparison in comparisons:
        for note in dict.fromkeys(comparison.notes):
            where.setdefault(note, []).append(comparison.recording)
    if len(comparisons) == 1:
        return tuple(where)
    return tuple(
        f"{names[0]}: {note}{f' (and in {len(names) - 1} more recordings)' if len(names) > 1 else ''}" for note, names in where.items()
    )


def _targets(rows: Sequence[ChannelDifference], pooled: Sequence[Pooled]) -> tuple[TargetDifference, ...]:
    """Joints, parts, wheels and drives by what of them is beyond the noise."""
    groups: dict[tuple[Kind, str], list[tuple[ChannelDifference, float, float]]] = {}
    for row, channel in zip(rows, pooled, strict=True):
        known = np.isfinite(channel.z)
        if row.left_out or not known.any():
            continue
        key = QUANTITIES[row.quantity].target, row.target
        groups.setdefault(key, []).append((row, float(np.sum(channel.z[known] ** 2)), float(np.sum(channel.degrees[known]))))
    beyond = {key: sum(max(0.0, square - freedom) for _, square, freedom in parts) for key, parts in groups.items()}
    whole = sum(beyond.values())
    found = []
    for (kind, name), parts in groups.items():
        square, freedom = sum(part[1] for part in parts), sum(part[2] for part in parts)
        parts.sort(key=lambda part: part[2] / max(part[1], 1e-300))
        found.append(
            TargetDifference(
                kind=kind,
                name=name,
                channels=tuple(part[0].name for part in parts),
                n=sum(part[0].n for part in parts),
                normalised=float(np.sqrt(square / freedom)),
                excess=float(np.sqrt(max(0.0, square / freedom - 1))),
                share=beyond[kind, name] / whole if whole > 0 else 0.0,
                differs=any(part[0].differs for part in parts),
            )
        )
    return tuple(sorted(found, key=lambda target: (not target.differs, -target.normalised)))


def _runs(comparisons: Sequence[Comparison], pooled: Sequence[Pooled]) -> tuple[RunDifference, ...]:
    found = []
    for channel in pooled:
        edges = np.searchsorted(channel.run, np.arange(len(comparisons) + 1))
        for run, comparison in enumerate(comparisons):
            part = slice(edges[run], edges[run + 1])
            known = np.isfinite(channel.residual[part])
            if not known.any():
                continue
            residual, z, degrees = channel.residual[part][known], channel.z[part][known], channel.degrees[part][known]
            found.append(
                RunDifference(
                    recording=comparison.recording,
                    channel=channel.channel.name,
                    n=len(residual),
                    rms=float(np.sqrt(np.mean(residual**2))),
                    bias=float(np.mean(residual)),
                    normalised=float(np.sqrt(np.sum(z**2) / np.sum(degrees))),
                )
            )
    order = {comparison.recording: k for k, comparison in enumerate(comparisons)}
    return tuple(sorted(found, key=lambda run: order[run.recording]))


def _sentence(rows: Sequence[ChannelDifference], targets: Sequence[TargetDifference], windows: Sequence[WindowDifference]) -> str:
    """The verdict in words."""
    known = [row for row in rows if row.judged]
    if not known:
        return "nothing could be judged: no channel has a known noise and enough samples"
    differing = sorted((row for row in known if row.differs), key=lambda row: -row.normalised)
    if not differing:
        size = np.sqrt(np.mean([row.normalised**2 for row in known]))
        some = sum(window.differs for window in windows)
        beyond = f"; {some} of {len(windows)} windows exceed it all the same, the worst is number {windows[0].number}" if some else ""
        if size > PLAIN:
            return (
                f"nothing is missing that could be told: what is left in {len(known)} channels, {size:.3g} times a noise that is next to "
                f"none, is within what their instants and rounding leave open{beyond}"
            )
        return f"nothing is missing: the residuals of all {len(known)} channels are white at the noise (RMS / noise {size:.2f}){beyond}"
    worst = differing[0]
    target = next(target for target in targets if target.differs)
    return (
        f"{len(differing)} of {len(known)} channels differ beyond the noise; most: {worst.of} ('{worst.name}'), {worst.normalised:.3g} "
        f"times its noise, {worst.verdict}; {target.kind} '{target.name}' differs most and holds {100 * target.share:.0f} % of what is "
        "beyond the noise"
    )
