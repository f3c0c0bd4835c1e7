"""Whether one law without a name does what an answer needs several causes for that meet at one joint.

Two causes that only together explain what one joint does are rarer than one that the catalogue has no name for: a seal that drags one way
is followed by dry friction and a drift of the sensor beside it. What decides is what the numbers cost (Schwarz 1978): the one law stands
instead if it leaves no more, as many numbers fewer considered.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rille.diagnosis.evidence.evidence import Evidence
from rille.diagnosis.hypotheses.formulas import sharper
from rille.diagnosis.hypotheses.natural import Natural
from rille.diagnosis.inference.doubt import DOUBTED
from rille.diagnosis.inference.found import Found, with_doubt
from rille.diagnosis.inference.judge import Judge
from rille.diagnosis.inference.unknown import Progress, Unknown, find_unknown
from rille.model.hypothesis import Setting
from rille.model.machine import Machine
from rille.model.recording import Channel

NUMBERS = 1  # of one law
SHARPER = 0.1  # of the speed over which its sign changes: dry friction of a machine turns round faster than a screen needs
SIMPLER = (
    "{answer} would explain it, too, but one law at joint '{joint}' does as well with {fewer} numbers less: two causes that meet at one "
    "joint may be one that has no name"
)


def one_law_instead(
    evidence: Evidence,
    found: Found,
    machine: Machine,
    scales: Natural,
    channels: Sequence[Channel],
    *,
    floor: float,
    on_progress: Progress = None,
) -> tuple[Found, Unknown] | None:
    """The answer that one law without a name stands for instead, and that law; None if none does, or the answer is no such one.

    Parameters
    ----------
    evidence : beside the base model. found : an answer that names causes. floor : as of ``search``.
    """
    joint = shared_joint(found.setting, machine, channels)
    if len(found.setting) < 2 or not joint:
        return None
    law = find_unknown(evidence, machine, scales, targets=[("joint", joint)], most=NUMBERS, on_progress=on_progress)
    if law is None:
        return None
    shapes = [law.setting, sharper(law.setting, SHARPER)]
    judges = [Judge(evidence.relinearised(setting), setting, floor=floor) for setting in shapes]
    judge = min(judges, key=lambda one: one.chi2)
    fewer = sum(len(term.hypothesis.free) for term in found.setting) - NUMBERS
    if (judge.chi2 - found.chi2_after) / found.kappa > fewer * np.log(max(judge.degrees, 2.0)):
        return None
    answer = " + ".join(term.hypothesis.title for term in found.setting)
    note = SIMPLER.format(answer=answer, joint=joint, fewer=fewer)
    instead = replace(
        with_doubt(found, DOUBTED),
        verdict="unknown",
        setting=(),
        terms=(),
        evidence=judge.evidence,
        chi2_after=judge.chi2,
        degrees_after=judge.degrees,
        notes=(*found.notes, note),
    )
    return instead, replace(law, setting=judge.on_top)


def shared_joint(setting: Setting, machine: Machine, channels: Sequence[Channel]) -> str:
    """The joint at which all terms of a setting act: on it, on its drive, or on a sensor of it; '' if there is none."""
    joints = {j.name for j in machine.joints}
    of_drive = {d.name: d.joint for d in machine.drives}
    of_channel = {c.name: c.target for c in channels}
    places = set()
    for term in setting:
        target = term.hypothesis.target
        place = of_channel.get(target, "") if term.hypothesis.cause == "sensor" else of_drive.get(target, target)
        places.add(place if place in joints else "")
    return places.pop() if len(places) == 1 else ""
