"""Whether one law without a name at a joint does what an answer needs many numbers for.

Two causes that only together explain what one joint does are rarer than one that the catalogue has no name for: a seal that drags one way
is followed by dry friction and a drift of the sensor beside it. What decides is what the numbers cost (Schwarz 1978): the one law stands
instead if it leaves no more, as many numbers fewer considered.

So does a rubber stop what a cable does that comes taut, wherever that is fixed at the body that the joint carries. Both are one cause, and
neither is rarer than the other: they are told apart by nothing, and the name is no more likely than that it has none.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rille.diagnosis.evidence.evidence import Evidence
from rille.diagnosis.hypotheses.formulas import sharper
from rille.diagnosis.hypotheses.natural import Natural, moving_bodies
from rille.diagnosis.inference.doubt import DOUBTED
from rille.diagnosis.inference.found import Found, with_doubt
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.unknown import Progress, Unknown, find_unknown
from rille.model.hypothesis import Setting
from rille.model.machine import Machine
from rille.model.recording import Channel

MANY = 4  # numbers of one cause at a body, from which on a law with fewer is looked for
EVEN = 0.5  # probability of none of the catalogue, where one law without a name does what one with a name does
SHARPER = 0.1  # of the speed over which its sign changes: dry friction of a machine turns round faster than a screen needs
SIMPLER = (
    "{answer} would explain it, too, but one law at joint '{joint}' does as well with {fewer} numbers less: two causes that meet at one "
    "joint may be one that has no name"
)
ALIKE = "a law without a name at joint '{joint}', {formula}, does as well as {answer}, with {fewer} numbers less: it may be either"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Instead:
    """One law at a joint that does as well. fewer : numbers that it needs less."""

    law: Unknown
    joint: str
    judge: Judge
    fewer: int


def beside_one_law(
    evidence: Evidence,
    found: Found,
    machine: Machine,
    scales: Natural,
    channels: Sequence[Channel],
    *,
    floor: float,
    on_progress: Progress = None,
) -> tuple[Found, Unknown | None]:
    """The answer beside one law without a name that does as well with fewer numbers: of several causes the law stands instead, and is
    returned, too; one cause with many numbers at a body is only as likely as the law. The answer as it is where there is no such law.

    Parameters
    ----------
    evidence : beside the base model. found : an answer that names causes. floor : as of ``search``.
    """
    several = len(found.setting) > 1
    if not several and not _is_wide(found.setting):
        return found, None
    one = _one_law(evidence, found, machine, scales, channels, floor, on_progress)
    if one is None:
        return found, None
    answer = " + ".join(term.hypothesis.title for term in found.setting)
    if not several:
        note = ALIKE.format(joint=one.joint, formula=one.law.formula, answer=answer, fewer=one.fewer)
        return replace(with_doubt(found, EVEN), verdict="group", notes=(*found.notes, note)), None
    note = SIMPLER.format(answer=answer, joint=one.joint, fewer=one.fewer)
    instead = replace(
        with_doubt(found, DOUBTED),
        verdict="unknown",
        setting=(),
        terms=(),
        evidence=one.judge.evidence,
        chi2_after=one.judge.chi2,
        degrees_after=one.judge.degrees,
        notes=(*found.notes, note),
    )
    return instead, one.law


def _is_wide(setting: Setting) -> bool:
    """Whether it is one effect at a body with many numbers."""
    return len(setting) == 1 and setting[0].hypothesis.target_kind == "body" and len(setting[0].hypothesis.free) >= MANY


def _one_law(
    evidence: Evidence, found: Found, machine: Machine, scales: Natural, channels: Sequence[Channel], floor: float, on_progress: Progress
) -> _Instead | None:
    """The law at the joint where all causes of an answer act, if it does as well."""
    joint = shared_joint(found.setting, machine, channels)
    if not joint:
        return None
    law = find_unknown(evidence, machine, scales, targets=[("joint", joint)], most=1, proven=False, on_progress=on_progress)
    if law is None:
        return None
    shapes = [law.setting, sharper(law.setting, SHARPER)]
    judges = [Judge(evidence.relinearised(setting), setting, floor=floor) for setting in shapes]
    judge = min(judges, key=lambda one: one.chi2)
    fewer = sum(len(term.hypothesis.free) for term in found.setting) - law.numbers
    if fewer < 1 or (judge.chi2 - found.chi2_after) / found.kappa > fewer * np.log(max(judge.degrees, 2.0)):
        return None
    return _Instead(law=replace(law, setting=judge.on_top), joint=joint, judge=judge, fewer=fewer)


def shared_joint(setting: Setting, machine: Machine, channels: Sequence[Channel]) -> str:
    """The joint at which all terms of a setting act: on it, on its drive, on a sensor of it, or on the body that it alone lets move; ''
    if there is none.
    """
    joints = {j.name for j in machine.joints}
    moving = moving_bodies(machine)
    of_body = {j.child: j.name for j in machine.joints if j.child in moving and j.parent not in moving and j.kind in ("hinge", "prismatic")}
    of_drive = {d.name: d.joint for d in machine.drives}
    of_channel = {c.name: c.target for c in channels}
    places = set()
    for term in setting:
        target = term.hypothesis.target
        if term.hypothesis.cause == "sensor":
            place = of_channel.get(target, "")
        elif term.hypothesis.target_kind == "body":
            place = of_body.get(target, "")
        else:
            place = of_drive.get(target, target)
        places.add(place if place in joints else "")
    return places.pop() if len(places) == 1 else ""
