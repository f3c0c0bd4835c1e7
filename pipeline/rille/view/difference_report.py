"""The difference report: where a model differs from recordings, as one HTML page that works without a network."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from rille.model import Rover, Terrain
from rille.model.comparison import Comparison
from rille.model.difference import Difference
from rille.model.recording import GateFinding
from rille.view.bench_difference_plots import points_section
from rille.view.difference_map import map_data
from rille.view.difference_plots import Kept, kept_recordings, recording_data, regime_data, whiteness_data
from rille.view.difference_rover import rover_picture
from rille.view.difference_tables import channel_table, findings_table, regime_table, run_table, target_table, window_table, words
from rille.view.page import Page, Section, empty_figure, escaped, number, template, write_page

MODES = {
    "windows": "in windows from recorded states",
    "whole": "whole, from one start state",
    "inverse_dynamics": "inverse dynamics",
    "points": "steady points of a bench",
}


def write_difference_report(
    path: str | Path,
    difference: Difference,
    comparisons: Sequence[Comparison],
    *,
    rover: Rover | None = None,
    terrain: Terrain | None = None,
    gate_findings: Mapping[str, Sequence[GateFinding]] | None = None,
) -> list[str]:
    """Write the page.

    Parameters
    ----------
    path : of the HTML file. comparisons : what ``difference`` was made of. rover, terrain : for the pictures. gate_findings : recording's
    name -> what the data gate found in it.

    Returns
    -------
    Notes about what could not be drawn.

    Raises
    ------
    InputRefused : if the file cannot be written.
    """
    kept = kept_recordings(difference, comparisons)
    points = difference.mode == "points"
    picture, notes = rover_picture(rover, difference.targets) if rover is not None and not points else ("", [])
    places = map_data(difference, comparisons, terrain) if not points else None
    sections = [
        Section(key="channels", title="Channels", lead="A row shows its plots.", body=channel_table(difference)),
        *(points_section(comparison, f"points-{index}") for index, comparison in enumerate(comparisons) if comparison.mode == "points"),
        *([_explorer(difference, kept, len(comparisons))] if difference.channels else []),
        Section(
            key="worst",
            title="Curves" if points else "Worst windows",
            lead="Ranked by the residual over all channels that take part. A row goes there.",
            body=window_table(difference, comparisons, {comparisons[index].recording: index for index in kept.recordings}),
        ),
    ]
    if len(comparisons) > 1:
        sections.append(_runs(difference, comparisons, kept))
    if difference.regimes:
        sections.append(_regimes(difference))
    if places is not None:
        sections.append(_map(difference, terrain))
    if picture or difference.targets:
        body = (picture or "".join(f"<p>{escaped(note)}</p>" for note in notes)) + target_table(difference)
        sections.append(Section(key="machine", title="Machine", lead="Every part by the residual of what was measured of it.", body=body))
    if difference.channels:
        sections.append(_whiteness(difference))
    if gate_findings is not None:
        sections.append(
            Section(key="gate", title="Data gate", lead="What was found in the recordings themselves.", body=findings_table(gate_findings))
        )
    sections.append(Section(key="reading", title="How to read this", body=words(difference, comparisons, notes)))
    data = {
        "mode": difference.mode,
        "channels": [
            {"name": channel.name, "of": channel.of, "unit": channel.unit, "leftOut": channel.left_out, "verdict": channel.verdict}
            for channel in difference.channels
        ],
        "recordings": {str(index): recording_data(comparisons[index], difference, kept.points) for index in kept.recordings},
        "names": [comparison.recording for comparison in comparisons],
        "start": _start(difference, comparisons, kept),
        "runs": _run_cells(difference, comparisons) if len(comparisons) > 1 else None,
        "regimes": regime_data(difference, comparisons) if difference.regimes else None,
        "map": places,
        "whiteness": whiteness_data(difference, comparisons),
        "highest": _highest(difference),
    }
    write_page(path, _page(difference, comparisons, sections, data))
    return notes


def _highest(difference: Difference) -> float:
    """Upper end of the colours: the worst window of a channel, but no single far one among very many."""
    values = [value for window in difference.windows for value in window.channels.values() if math.isfinite(value)]
    return max(3.0, float(np.quantile(values, 0.999))) if values else 3.0


def _page(difference: Difference, comparisons: Sequence[Comparison], sections: Sequence[Section], data: Mapping[str, object]) -> Page:
    counted = [channel for channel in difference.channels if not channel.left_out]
    several = f"{len(comparisons)} recordings"
    facts = {
        "Model": difference.model,
        "Recordings" if len(comparisons) > 1 else "Recording": several if len(comparisons) > 1 else difference.recordings[0],
        "Replayed": MODES[difference.mode],
        "Curves" if difference.mode == "points" else "Windows": f"{sum(len(comparison.windows) for comparison in comparisons):,}".replace(
            ",", "\u202f"
        ),
        "Samples": f"{sum(channel.n for channel in difference.channels):,}".replace(",", "\u202f"),
        "Channels that differ": f"{sum(channel.differs for channel in counted)} of {len(counted)}",
        "χ² per degree of freedom": number(difference.chi2_per_degree),
    }
    scenarios = sorted({comparison.scenario for comparison in comparisons if comparison.scenario})
    return Page(
        title=f"Measured against simulated: {difference.recordings[0] if len(comparisons) == 1 else several}",
        subtitle=f"model {Path(difference.model).name}" + (f", scenario {', '.join(scenarios[:3])}" if scenarios else ""),
        verdict=difference.sentence[:1].upper() + difference.sentence[1:],
        tone="bad" if difference.differs else "good",
        facts=facts,
        sections=sections,
        script=template("difference.js") if difference.channels else "",
        data=data,
    )


def _start(difference: Difference, comparisons: Sequence[Comparison], kept: Kept) -> dict[str, object]:
    """What the page shows first: the worst window's recording and channel."""
    names = [channel.name for channel in difference.channels]
    taking_part = [k for k, channel in enumerate(difference.channels) if not channel.left_out]
    first = difference.windows[0].channel if difference.windows else ""
    channel = names.index(first) if first in names else (taking_part or [0])[0]
    return {"recording": kept.recordings[0] if kept.recordings else -1, "channel": channel}


def _explorer(difference: Difference, kept: Kept, recordings: int) -> Section:
    window = "curve" if difference.mode == "points" else "window"
    lead = f"Every cell is one {window} of one channel: its residual over its noise. Click one to go there."
    if len(kept.recordings) < recordings:
        lead += f" The page holds the series of the {len(kept.recordings)} worst of {recordings} recordings."
    body = (
        '<div class="controls"><label>recording <select id="pick-recording"></select></label>'
        '<label>channel <select id="pick-channel" class="pick-channel"></select></label>'
        ""
        f'<button type="button" id="previous">◀ {window}</button><button type="button" id="next">{window} ▶</button>'
        '<button type="button" id="whole">whole recording</button></div><p class="shown" id="shown" aria-live="polite"></p>'
        + empty_figure(
            "strip", caption=f"RMS of the residual over the noise, per channel and {window}.", height=130 + 22 * len(difference.channels)
        )
        + empty_figure(
            "series",
            caption="Measured and simulated, below the residual with ±2 sigma of the noise. Red, with their ranks: the worst.",
            height=560,
        )
    )
    return Section(key="time", title="Over the points" if difference.mode == "points" else "Over time", lead=lead, body=body)


def _runs(difference: Difference, comparisons: Sequence[Comparison], kept: Kept) -> Section:
    body = empty_figure(
        "runs", caption="RMS of the residual over the noise, per channel and recording.", height=130 + 22 * len(difference.channels)
    ) + run_table(difference, {comparisons[index].recording: index for index in kept.recordings})
    return Section(key="recordings", title="Recordings", lead="One column per recording; click one to see it.", body=body)


def _run_cells(difference: Difference, comparisons: Sequence[Comparison]) -> list[list[float]]:
    """Normalised RMS (channels, recordings)."""
    found = {(run.channel, run.recording): run.normalised for run in difference.runs}
    return [[found.get((channel.name, c.recording), float("nan")) for c in comparisons] for channel in difference.channels]


def _regimes(difference: Difference) -> Section:
    body = (
        '<div class="controls"><label>channel <select class="pick-channel"></select></label>'
        '<label>against <select id="pick-regime"></select></label></div>'
        + empty_figure(
            "regime",
            caption="Normalised residuals (a sample of them), their mean with its error in equal-count bins, and their RMS.",
            height=420,
        )
        + regime_table(difference)
    )
    lead = "Does the residual depend on how the machine moved? Strongest dependences first; a row shows its plot."
    return Section(key="regimes", title="Against regimes", lead=lead, body=body)


def _map(difference: Difference, terrain: Terrain | None) -> Section:
    body = '<div class="controls"><label>coloured by <select id="pick-score"></select></label></div>' + empty_figure(
        "map", caption="The way of the root from above, coloured by the residual over its noise; numbers: the worst windows.", height=620
    )
    lead = "Click a place to see its window." + (f" Ground: {terrain.name}." if terrain is not None else "")
    return Section(key="map-section", title="Map", lead=lead, body=body)


def _whiteness(difference: Difference) -> Section:
    body = (
        '<div class="controls"><label>channel <select class="pick-channel"></select></label></div><p class="shown" id="white-words"></p>'
        '<div class="columns">'
        + empty_figure(
            "correlation", caption="Autocorrelation of the residual within windows; white ones stay in the band (95 %).", height=340
        )
        + empty_figure(
            "quantiles", caption="Quantiles of the residual over its noise; on the line: normal, with the stated noise.", height=340
        )
        + "</div>"
    )
    lead = "Residuals of a model that misses nothing are noise: uncorrelated in time, and of the noise's size."
    return Section(key="whiteness", title="Whiteness", lead=lead, body=body)
