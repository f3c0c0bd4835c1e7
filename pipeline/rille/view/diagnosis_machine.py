"""The machine of a diagnosis: what is named in red, what cannot be told apart from it in amber."""

import math
from collections.abc import Mapping, Sequence

from rille.model import Rover
from rille.model.comparison import Comparison
from rille.model.diagnosis import Diagnosis
from rille.model.difference import Difference, TargetDifference
from rille.model.hypothesis import Hypothesis
from rille.view.difference_rover import rover_picture
from rille.view.machine_picture import REST, machine_picture
from rille.view.pose import placed_meshes

ACCUSED, SUSPECT = "#b3261e", "#e0a13b"
LABELS = 6
ZOOM = 1.6  # of labels: the picture takes half of the page


def accused_bodies(rover: Rover, hypothesis: Hypothesis, channel_targets: Mapping[str, str]) -> tuple[str, ...]:
    """Bodies that a hypothesis is about: what a joint, wheel or drive moves; what a recorded channel was measured of.

    channel_targets : of every recorded channel. A wrong number of the ground or the world is about no body.
    """
    moved = {joint.name: joint.child for joint in rover.joints}
    bodies = {body.name: body.name for body in rover.bodies}
    wheels = {wheel.name: moved[wheel.joint] for wheel in rover.wheels}
    drives = {drive.name: moved[drive.joint] for drive in rover.drives}
    everything = wheels | drives | moved | bodies
    known = {"joint": moved, "wheel": wheels, "drive": drives, "body": bodies, "part": bodies}.get(hypothesis.target_kind, everything)
    target = channel_targets.get(hypothesis.target, hypothesis.target) if hypothesis.cause == "sensor" else hypothesis.target
    if target == "*":
        return tuple(dict.fromkeys(known.values())) if hypothesis.target_kind in ("joint", "wheel", "drive", "body") else ()
    found = known.get(target) or everything.get(target)
    if found is None and hypothesis.target_kind == "machine":
        return tuple(dict.fromkeys(wheels.values()))
    return () if found is None else (found,)


def accused_picture(
    diagnosis: Diagnosis, difference: Difference | None, comparisons: Sequence[Comparison], rover: Rover | None
) -> tuple[str, list[str]]:
    """The machine with what is named in red and what cannot be told apart from it in amber; if nothing is named, by residual."""
    if rover is None or next(placed_meshes(rover), None) is None:
        return "", []
    targets = {c.channel.name: c.channel.target for comparison in comparisons for c in comparison.channels}
    told: dict[str, str] = {}
    for hypothesis in diagnosis.hypotheses or _first(diagnosis):
        told |= {body: hypothesis.kind for body in accused_bodies(rover, hypothesis, targets)}
    suspects: dict[str, str] = {}
    for ranked in diagnosis.ranked[1:]:
        if ranked.group and ranked.group == diagnosis.ranked[0].group:
            for term in ranked.terms:
                hypothesis = term.term.hypothesis
                suspects |= {body: hypothesis.kind for body in accused_bodies(rover, hypothesis, targets) if body not in told}
    if not told or diagnosis.verdict in ("nothing_missing", "unknown", "cannot_know"):
        scores = difference.targets if difference is not None else _scores(diagnosis)
        return rover_picture(rover, scores, zoom=ZOOM) if scores else ("", [])
    colors = dict.fromkeys(suspects, SUSPECT) | dict.fromkeys(told, ACCUSED)
    labels = [(body, body, kind) for body, kind in [*told.items(), *suspects.items()]][:LABELS]
    said = ", ".join(f"{body}: {kind}" for body, kind in told.items())
    legend = (
        f'<div class="scale"><span><i class="swatch" style="background:{ACCUSED}"></i>named</span>'
        + (f'<span><i class="swatch" style="background:{SUSPECT}"></i>not told apart from it</span>' if suspects else "")
        + f'<span><i class="swatch" style="background:{REST}"></i>not concerned</span></div>'
    )
    return machine_picture(rover, colors, labels, alt=f"The machine. Named: {said}", legend=legend, zoom=ZOOM)


def _first(diagnosis: Diagnosis) -> tuple[Hypothesis, ...]:
    """Sensor faults are named without being put into the model."""
    if diagnosis.verdict != "sensor_fault" or not diagnosis.ranked:
        return ()
    return tuple(term.term.hypothesis for term in diagnosis.ranked[0].terms)


def _scores(diagnosis: Diagnosis) -> list[TargetDifference]:
    kinds = ("joint", "part", "wheel", "drive")
    return [
        TargetDifference(
            kind=t.kind,  # type: ignore[arg-type]
            name=t.name,
            channels=(),
            n=0,
            normalised=t.size,
            excess=math.sqrt(max(t.size**2 - 1, 0.0)),
            share=t.share,
            differs=t.differs,
        )
        for t in diagnosis.location.targets
        if t.kind in kinds and math.isfinite(t.size)
    ]
