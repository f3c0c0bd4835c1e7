"""Frozen values in SI units and radians. This layer imports nothing else of rille.

Values refer to each other by name; :mod:`rille.store` turns names into keys and back. Poses, points and axes of the
model are given in the model frame M at the zero pose (the pose of the CAD assembly); see ``schema/README.md``.
"""

from rille.model.bench import BenchPoints, BenchWheel
from rille.model.effect import Effect, EffectKind, EffectParameter
from rille.model.errors import InputRefused, MachineFailed, PhysicsFailed, nearest_names
from rille.model.rover import (
    Body,
    CollisionShape,
    Differential,
    Drive,
    Gear,
    Grouser,
    Joint,
    JointLimit,
    LoopClosure,
    MassProperties,
    Material,
    Mesh,
    Part,
    PartInstance,
    Pose,
    Provenance,
    Rover,
    Sensor,
    SourceFile,
    Wheel,
)
from rille.model.scenario import Command, InitialJointState, Scenario, StateChange, Watch
from rille.model.terrain import LandformInstance, MaterialPair, Obstacle, Population, Soil, SoilPatch, Terrain
from rille.model.trace import BodyTrace, EnergyTrace, Event, JointTrace, Ruts, Trace, WheelTrace

__all__ = [
    "BenchPoints",
    "BenchWheel",
    "Body",
    "BodyTrace",
    "CollisionShape",
    "Command",
    "Differential",
    "Drive",
    "Effect",
    "EffectKind",
    "EffectParameter",
    "EnergyTrace",
    "Event",
    "Gear",
    "Grouser",
    "InitialJointState",
    "InputRefused",
    "Joint",
    "JointLimit",
    "JointTrace",
    "LandformInstance",
    "LoopClosure",
    "MachineFailed",
    "MassProperties",
    "Material",
    "MaterialPair",
    "Mesh",
    "Obstacle",
    "Part",
    "PartInstance",
    "PhysicsFailed",
    "Population",
    "Pose",
    "Provenance",
    "Rover",
    "Ruts",
    "Scenario",
    "Sensor",
    "Soil",
    "SoilPatch",
    "SourceFile",
    "StateChange",
    "Terrain",
    "Trace",
    "Watch",
    "Wheel",
    "WheelTrace",
    "nearest_names",
]
