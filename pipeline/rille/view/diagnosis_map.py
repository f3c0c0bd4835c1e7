"""Map of a diagnosis: the way from above by its residual, and the places that were named."""

import html
import math
from collections.abc import Sequence

import numpy as np

from rille.model import Terrain
from rille.model.comparison import Comparison
from rille.model.diagnosis import Diagnosis
from rille.model.difference import Difference
from rille.view.difference_map import ground_image, ways_of
from rille.view.page import figure, packed


def place_map(diagnosis: Diagnosis, difference: Difference | None, comparisons: Sequence[Comparison], terrain: Terrain | None) -> str:
    """The way from above, coloured by the residual, with marked spans and the places that were named."""
    if difference is None or difference.mode == "points":
        return ""
    ways = ways_of(difference, comparisons)
    if not ways:
        return ""
    x, y, score = (np.concatenate(parts) for parts in zip(*((way.x, way.y, way.scores[0]) for _, way in ways), strict=True))
    known = np.isfinite(x) & np.isfinite(y) & np.isfinite(score)
    way = {
        "type": "scatter",
        "mode": "markers",
        "x": packed(x[known]),
        "y": packed(y[known]),
        "marker": {
            "size": 6,
            "color": packed(score[known]),
            "cmin": 1,
            "cmax": max(3.0, min(30.0, _upper(difference))),
            "colorscale": [[0, "var(--heat1)"], [0.4, "var(--heat2)"], [0.7, "var(--heat3)"], [1, "var(--heat4)"]],
            "colorbar": {"title": {"text": "\u00d7 noise"}, "thickness": 12, "len": 0.8},
        },
        "hovertemplate": "x %{x:.2f} m, y %{y:.2f} m: %{marker.color:.2f} \u00d7 noise<extra></extra>",
    }
    layout: dict[str, object] = {
        "showlegend": False,
        "xaxis": {"title": {"text": "x [m]"}, "zeroline": False},
        "yaxis": {"title": {"text": "y [m]"}, "scaleanchor": "x", "zeroline": False},
        "margin": {"l": 56, "r": 10, "t": 10, "b": 44},
    }
    image = ground_image(terrain, x, y) if terrain is not None else None
    if image is not None:
        ends = {"x": image["west"], "y": image["north"], "sizex": image["east"] - image["west"], "sizey": image["north"] - image["south"]}
        shown = {"source": image["source"], "xref": "x", "yref": "y", "sizing": "stretch", "layer": "below", "opacity": 0.85}
        layout["images"] = [{**shown, **ends}]
        layout["xaxis"] = {"title": {"text": "x [m]"}, "showgrid": False, "zeroline": False, "range": [image["west"], image["east"]]}
        layout["yaxis"] = {
            "title": {"text": "y [m]"},
            "showgrid": False,
            "zeroline": False,
            "scaleanchor": "x",
            "range": [image["south"], image["north"]],
        }
    circles = _circles(diagnosis)
    layout["shapes"] = [
        {
            "type": "circle",
            "xref": "x",
            "yref": "y",
            "x0": x - r,
            "x1": x + r,
            "y0": y - r,
            "y1": y + r,
            "line": {"color": "var(--bad)", "width": 2.5},
            "fillcolor": "rgba(179, 38, 30, .12)",
        }
        for x, y, r, _ in circles
    ]
    layout["annotations"] = [
        {"x": x, "y": y + r, "text": html.escape(title), "showarrow": True, "arrowhead": 0, "ay": -24, "ax": 0, "bgcolor": "var(--card)"}
        for x, y, r, title in circles
    ]
    caption = "The way of the machine from above, coloured by the residual over its noise."
    caption += " Circle: the place that is named." if circles else ""
    return figure("map", [way], layout, caption=caption, height=430)


def _upper(difference: Difference) -> float:
    values = [w.normalised for w in difference.windows if math.isfinite(w.normalised)]
    return float(np.quantile(values, 0.98)) if values else 3.0


def _circles(diagnosis: Diagnosis) -> list[tuple[float, float, float, str]]:
    """x, y, radius [m], title of what has a place on the ground: two numbers searched over places, and a length if there is one."""
    found = []
    for term in diagnosis.setting:
        numbers = dict(zip([n.name for n in term.hypothesis.free], zip(term.hypothesis.free, term.values, strict=True), strict=True))
        places = [value for number, value in numbers.values() if number.search == "place" and number.unit == "m"]
        if len(places) >= 2:
            lengths = [v for n, v in numbers.values() if not n.amplitude and n.unit == "m" and n.search != "place"]
            found.append((places[0], places[1], lengths[0] if lengths else 0.2, term.hypothesis.kind))
    return found
