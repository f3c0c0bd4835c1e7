"""The machine with its parts lit by how much the model misses there."""

import math
from collections.abc import Sequence

import numpy as np

from rille.model import Rover
from rille.model.difference import TargetDifference
from rille.view.machine_picture import REST, machine_picture
from rille.view.page import number

LEVELS = (0.0, 0.3, 0.65, 1.0)  # of the colours, on a logarithmic scale from the noise to the worst
SHADES = ("#d7e3ea", "#f3d27a", "#e07b39", "#a11d1d")
NAMED = 6  # targets with a label


def body_scores(rover: Rover, targets: Sequence[TargetDifference]) -> dict[str, TargetDifference]:
    """The worst target of every body: a joint's, wheel's or drive's is the body that it moves."""
    moved = {joint.name: joint.child for joint in rover.joints}
    bodies = {body.name: body.name for body in rover.bodies}
    of_wheel = {wheel.name: moved[wheel.joint] for wheel in rover.wheels}
    of_drive = {drive.name: moved[drive.joint] for drive in rover.drives}
    places = {"joint": moved, "wheel": of_wheel, "drive": of_drive, "part": bodies}
    found: dict[str, TargetDifference] = {}
    for target in targets:
        body = places[target.kind].get(target.name) or moved.get(target.name) or bodies.get(target.name)
        if body is not None and math.isfinite(target.normalised):
            worse = found.get(body)
            if worse is None or target.normalised > worse.normalised:
                found[body] = target
    return found


def heat(normalised: float, highest: float) -> str:
    """Colour of an RMS over noise: pale up to the noise, red at ``highest``, logarithmic between."""
    part = math.log(max(normalised, 1.0)) / math.log(max(highest, 3.0))
    channels = [np.interp(part, LEVELS, [int(shade[k : k + 2], 16) for shade in SHADES]) for k in (1, 3, 5)]
    return "#" + "".join(f"{round(float(channel)):02x}" for channel in channels)


def rover_picture(rover: Rover, targets: Sequence[TargetDifference], *, zoom: float = 1.0) -> tuple[str, list[str]]:
    """HTML of the picture with its scale and labels (times ``zoom``) of the worst targets; notes about what could not be drawn."""
    scores = body_scores(rover, targets)
    if not scores:
        return "", []
    highest = max(3.0, max(target.normalised for target in scores.values()))
    named = sorted((body for body in scores if scores[body].differs), key=lambda body: -scores[body].normalised)[:NAMED]
    alt = "The machine; its parts are coloured by RMS over noise. " + ", ".join(
        f"{scores[body].name}: {number(scores[body].normalised)}" for body in named
    )
    return machine_picture(
        rover,
        {body: heat(target.normalised, highest) for body, target in scores.items()},
        [(body, scores[body].name, f"{number(scores[body].normalised)} \u00d7 noise") for body in named],
        alt=alt,
        legend=_scale(highest),
        zoom=zoom,
    )


def _scale(highest: float) -> str:
    """The colours in words."""
    stops = ", ".join(f"{shade} {100 * level:.0f}%" for level, shade in zip(LEVELS, SHADES, strict=True))
    ticks = [tick for tick in (1, 2, 3, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000) if tick <= highest]
    places = "".join(f'<span style="left:{100 * math.log(tick) / math.log(highest):.1f}%">{tick}</span>' for tick in ticks)
    return (
        f'<div class="scale" aria-hidden="true"><div><div class="ramp" style="background:linear-gradient(90deg, {stops})"></div>'
        f'<div class="ticks">{places}</div></div><span>RMS of the residual over noise</span>'
        f'<span><i class="swatch" style="background:{REST}"></i>not measured</span></div>'
    )
