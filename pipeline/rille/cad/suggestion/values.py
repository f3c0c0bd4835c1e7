"""What is suggested about a mechanism: bodies, joints and wheels, as values."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

THRESHOLD = 0.5  # of the confidence: above it a finding is likelier right than wrong

JointKind = Literal["hinge", "prismatic", "spherical"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SuggestedBody:
    """Instances (indices into the assembly's) that move together. notes : what was assumed."""

    name: str
    instances: tuple[int, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SuggestedJoint:
    """A joint: point [m] and unit axis, shape (3,), in the assembly's frame.

    parent, child : names of bodies. moving : instances of the child. evidence, doubts : sentences. loop : it closes a circle of joints.

    Under the threshold both sides are one of the suggested bodies. Parent and child are then the bodies that there would be if this
    joint and those before it were used: ``moving`` are the instances that the child would take, ``staying`` those that the parent would
    keep, ``carries`` the joints above the threshold that would have the child as their parent. ``parent == child`` where no instance
    of its own would move.
    """

    name: str
    kind: JointKind
    parent: str
    child: str
    point: Array
    axis: Array
    confidence: float
    evidence: tuple[str, ...]
    doubts: tuple[str, ...]
    moving: tuple[int, ...]
    loop: bool = False
    staying: tuple[int, ...] = ()
    carries: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SuggestedWheel:
    """A wheel on a hinge. center [m], axis : unit, shapes (3,). radius of the rim without grousers, width, grouser sizes [m]."""

    name: str
    joint: str
    body: str
    instance: int
    center: Array
    axis: Array
    radius: float
    width: float
    grouser_count: int
    grouser_height: float
    grouser_thickness: float
    confidence: float
    evidence: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Suggestions:
    """What was found in an assembly. root : name of the body that carries the others."""

    bodies: tuple[SuggestedBody, ...]
    joints: tuple[SuggestedJoint, ...]
    wheels: tuple[SuggestedWheel, ...]
    root: str
    notes: tuple[str, ...] = ()
    threshold: float = THRESHOLD

    @property
    def accepted(self) -> tuple[SuggestedJoint, ...]:
        """The joints above the threshold that make a tree."""
        return tuple(j for j in self.joints if j.confidence >= self.threshold and not j.loop and j.parent != j.child)
