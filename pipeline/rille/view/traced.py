"""Numbers of a report that say where they stand in the JSON."""

import html
import math

from rille.view.page import Html, escaped, number


def traced(text: str, place: str) -> Html:
    """Text with its place in the JSON, "ranked[0].gain", shown on hovering and kept in ``data-json``."""
    return Html(f'<span class="traced" data-json="{html.escape(place)}" title="JSON: {html.escape(place)}">{escaped(text)}</span>')


def value_at(value: float, place: str, digits: int = 3) -> Html:
    """A number with its place."""
    return traced(number(value, digits), place)


def percent(value: float) -> str:
    """A share for a reader; neither 0 nor 100 unless it is."""
    if not math.isfinite(value):
        return "-"
    if 0 < value < 0.01:
        return "< 1 %"
    return "> 99 %" if 0.99 < value < 1 else f"{100 * value:.0f} %"


def percent_at(value: float, place: str) -> Html:
    """A share with its place."""
    return traced(percent(value), place)


def with_error(value: float, error: float) -> str:
    """Value and standard error, to the digits that the error allows."""
    if not (math.isfinite(value) and math.isfinite(error) and error > 0):
        return number(value)
    if max(abs(value), error) >= 1e5 or abs(value) < 1e-4 > error:
        return f"{number(value)} ± {number(error, 2)}"
    places = min(6, max(0, 1 - math.floor(math.log10(error))))
    return f"{value:.{places}f} ± {error:.{places}f}"


def interval(low: float, high: float, value: float) -> str:
    """Bounds to the digits that their distance allows."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return "-"
    wide = high - low
    if wide <= 0 or max(abs(low), abs(high), abs(value)) >= 1e5 or max(abs(low), abs(high)) < 1e-3:
        return f"{number(low)} to {number(high)}"
    places = min(6, max(0, 1 - math.floor(math.log10(wide))))
    return f"{low:.{places}f} to {high:.{places}f}"
