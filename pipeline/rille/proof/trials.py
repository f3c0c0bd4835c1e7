"""Which trials a beacon draws, and each of them as values: machine, maneuvers, sensors, what is concealed."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from rille.model import EffectKind, Scenario
from rille.proof.hidden import (
    SENSOR_FAULTS,
    WRONG_NUMBERS,
    Hidden,
    all_effects,
    effect_targets,
    hidden_effect,
    hidden_number,
    hidden_sensor_fault,
    same_thing,
)
from rille.proof.machines import MAKERS
from rille.proof.maneuvers import maneuver
from rille.proof.points import DESIGN
from rille.proof.sensors import Sensors, draw_sensors
from rille.proof.subject import Subject

Sort = Literal["one", "two", "outside", "parameter", "sensor", "nothing"]
SORTS: tuple[Sort, ...] = get_args(Sort)
TRAINING, HELD_OUT = ("training_1", "training_2"), "held_out"
SHARES: Mapping[str, float] = {"pendulum": 0.28, "arm": 0.28, "free_body": 0.22, "bench": 0.16, "rover": 0.06}  # of the trials


@dataclass(frozen=True, slots=True, kw_only=True)
class Extent:
    """How many trials of which sort, on which machines, at which strengths [noise], each as often."""

    counts: Mapping[Sort, int]
    machines: tuple[str, ...] = tuple(SHARES)
    strengths: tuple[float, ...] = (0.5, 1.0, 2.0, 5.0)


FULL = Extent(counts={"one": 100, "two": 40, "outside": 30, "parameter": 40, "sensor": 30, "nothing": 90})
QUICK = Extent(
    counts={"one": 6, "two": 1, "outside": 1, "parameter": 2, "sensor": 2, "nothing": 4},
    machines=("pendulum", "free_body", "bench"),
    strengths=(2.0, 5.0),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One trial, but for its details. strength : wanted excess of the residual [noise], of each piece alone; 0: nothing is concealed.

    beacon : what it was drawn from. draw : of how many draws; another one follows where a machine cannot be made to differ so much.
    """

    number: int
    sort: Sort
    machine: str
    strength: float
    beacon: str
    draw: int = 0

    @staticmethod
    def of(truth: Mapping[str, Any]) -> "Trial":
        """The trial that a truth is of: what it was drawn from is in the truth."""
        return Trial(**{one.name: truth[one.name] for one in fields(Trial)})

    def random(self, purpose: str) -> np.random.Generator:
        """Random numbers of a purpose."""
        return np.random.default_rng(_number(self.beacon, str(self.number), str(self.draw), purpose))

    def again(self) -> "Trial":
        """The next draw of the same sort, machine and strength."""
        return replace(self, draw=self.draw + 1)


def plan(beacon: str, extent: Extent = FULL) -> tuple[Trial, ...]:
    """The trials of a beacon, in the order in which they are answered: at random, so that a part of them is a fair sample."""
    rng = np.random.default_rng(_number(beacon, "plan"))
    drawn: list[tuple[Sort, str, float]] = []
    for sort in SORTS:
        fitting = [m for m in extent.machines if m in MACHINES_OF.get(sort, tuple(SHARES))]
        shares = np.array([SHARES[m] for m in fitting])
        for k in range(extent.counts.get(sort, 0)):
            machine = str(rng.choice(fitting, p=shares / shares.sum()))
            drawn.append((sort, machine, 0.0 if sort == "nothing" else extent.strengths[k % len(extent.strengths)]))
    order = rng.permutation(len(drawn))
    return tuple(
        Trial(number=n, sort=drawn[k][0], machine=drawn[k][1], strength=drawn[k][2], beacon=beacon) for n, k in enumerate(order.tolist())
    )


MACHINES_OF: Mapping[Sort, tuple[str, ...]] = {  # where not all are fit
    "sensor": ("pendulum", "arm", "free_body", "rover"),
    "outside": ("pendulum", "arm", "free_body", "rover"),
}


def _number(*words: str) -> int:
    """A whole number out of words, the same on every machine."""
    return int.from_bytes(hashlib.sha256("\x1f".join(words).encode()).digest()[:16], "big")


@dataclass(frozen=True)
class Drawn:
    """A trial in detail. kinds : the catalogue. strange : laws of the generator that are not in it."""

    trial: Trial
    kinds: Sequence[EffectKind]
    strange: Sequence[EffectKind]

    @cached_property
    def machine(self) -> Subject:
        """What the base model says."""
        return MAKERS[self.trial.machine](self.trial.random("machine"))

    @cached_property
    def scenarios(self) -> tuple[Scenario, ...]:
        """One for each recording, those to learn from first."""
        rng = self.trial.random("maneuver")
        names = tuple(DESIGN) if self.machine.kind == "points" else (*TRAINING, HELD_OUT)
        return tuple(maneuver(self.machine, name, rng) for name in names)

    @cached_property
    def sensors(self) -> Sensors | None:
        """As the manifest tells them; None: points of a bench."""
        return draw_sensors(self.machine, self.trial.random("sensors")) if self.machine.kind == "time" else None

    @cached_property
    def hides_noise(self) -> bool:
        """Whether the manifest does not tell the noise."""
        return self.sensors is not None and self.sensors.hides_noise

    @cached_property
    def hidden(self) -> tuple[Hidden, ...]:
        """What is concealed, but for its size."""
        rng = self.trial.random("hidden")
        match self.trial.sort:
            case "nothing":
                return ()
            case "one":
                return (self._effect(rng),)
            case "two":
                first = self._effect(rng)
                second = self._effect(rng)
                while same_thing(first, second):
                    second = self._effect(rng)
                return first, second
            case "parameter":
                numbers = WRONG_NUMBERS[self.trial.machine]
                return (hidden_number(*numbers[int(rng.integers(len(numbers)))], rng),)
            case "outside":
                found = all_effects(self.machine, self.strange)
                kind, target = found[int(rng.integers(len(found)))]
                return (hidden_effect(self.machine, kind, target, rng, cause="outside"),)
            case "sensor":
                assert self.sensors is not None
                faults = SENSOR_FAULTS if self.trial.strength >= 5 else SENSOR_FAULTS[:-1]  # a turned sign is never small
                sensor = self.sensors.sensors[int(rng.integers(len(self.sensors.sensors)))]
                return (hidden_sensor_fault(sensor.quantity, str(rng.choice(faults)), sensor.channel, rng),)

    def _effect(self, rng: np.random.Generator) -> Hidden:
        """An effect of the catalogue: each kind as likely as any other, at a target drawn."""
        kinds = [kind for kind in self.kinds if effect_targets(self.machine, kind)]
        kind = kinds[int(rng.integers(len(kinds)))]
        return hidden_effect(self.machine, kind, str(rng.choice(effect_targets(self.machine, kind))), rng)
