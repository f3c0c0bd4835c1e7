"""Which trials there are, and their names: machine/cause/what/target/strength/seed."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from zlib import crc32

import numpy as np
from faults import OWN, hidden_number
from instrument_sets import channels
from subjects import MAKERS, subject

from rille import store
from rille.proof.hidden import SENSOR_FAULTS, WRONG_NUMBERS, Hidden, all_effects, hidden_effect, hidden_sensor_fault

STRENGTHS = (1.0, 2.0, 5.0)
SMALL = ("pendulum", "arm", "free_body", "bench")
DEVELOPMENT = 1000  # seeds from here on are never part of the benchmark: thresholds and probabilities are calibrated on them
CONCEALED = 2000  # seeds from here on: what is wrong is kept out of the hypotheses, so that none of them is right
CONCEALED_SHARE = 4  # one of so many development trials


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One thing that is wrong with one machine. strength : wanted excess of the residual [noise]; 0: nothing is wrong."""

    machine: str
    cause: str
    kind: str = ""
    target: str = ""
    strength: float = 0.0
    seed: int = 0

    @property
    def name(self) -> str:
        """One word that tells everything; '-' where there is nothing."""
        return "/".join([self.machine, self.cause, self.kind or "-", self.target or "-", f"{self.strength:g}", str(self.seed)])

    @property
    def concealed(self) -> tuple[str, ...]:
        """Kinds and targets that diagnosis may not think of."""
        return (self.kind, self.target) if self.seed >= CONCEALED else ()

    def random(self, purpose: str) -> np.random.Generator:
        """Random numbers of a purpose. Maneuvers, sensors and shape numbers are the same at every strength, noise is not."""
        same = self.name if purpose == "noise" else "/".join([self.machine, self.cause, self.kind, self.target, str(self.seed)])
        return np.random.default_rng([crc32(same.encode()), crc32(purpose.encode())])

    def fault(self) -> Hidden | None:
        """What is wrong, but for its size; None: nothing."""
        machine, rng = subject(self.machine), self.random("fault")
        if self.cause == "effect":
            return hidden_effect(machine, store.find_effect_kind(self.kind), self.target, rng, own=OWN)
        if self.cause == "parameter":
            return hidden_number(self.kind, self.target, rng)
        if self.cause == "sensor":
            return hidden_sensor_fault(channels(machine)[self.target], self.kind, self.target, rng)
        return None


def trial_named(name: str) -> Trial:
    """The trial of that name."""
    machine, cause, kind, target, strength, seed = name.split("/")
    return Trial(
        machine=machine,
        cause=cause,
        kind="" if kind == "-" else kind,
        target="" if target == "-" else target,
        strength=float(strength),
        seed=int(seed),
    )


def full(machines: Sequence[str] = tuple(MAKERS), seeds: Sequence[int] = (0,)) -> Iterator[Trial]:
    """Every effect of the catalogue at every target of the small machines (of the rover: at one target drawn per seed), every wrong number,
    every sensor fault at one channel drawn per seed; at every strength; and as many runs in which nothing is wrong.
    """
    for seed in seeds:
        for machine in machines:
            yield from _of_machine(machine, seed)


def _of_machine(machine: str, seed: int) -> Iterator[Trial]:
    made = subject(machine)
    rng = np.random.default_rng([crc32(machine.encode()), seed])
    at: dict[str, list[str]] = {}
    for kind, target in all_effects(made, store.effect_kinds()):
        at.setdefault(kind.name, []).append(target)
    if machine not in SMALL:
        at = {kind: [str(rng.choice(targets))] for kind, targets in at.items()}
    faults = [("effect", kind, target) for kind, targets in at.items() for target in targets]
    faults += [("parameter", kind, target) for kind, target in WRONG_NUMBERS[machine]]
    if made.kind == "time":
        faults += [("sensor", kind, str(rng.choice(list(channels(made))))) for kind in SENSOR_FAULTS]
    for cause, kind, target in faults:
        for strength in STRENGTHS[-1:] if kind == "wrong_sign" else STRENGTHS:
            yield Trial(machine=machine, cause=cause, kind=kind, target=target, strength=strength, seed=seed)
    for k in range(20 if machine in SMALL else 5):
        yield Trial(machine=machine, cause="none", seed=100 * seed + k)


def quick(seed: int = 0) -> Iterator[Trial]:
    """A few of every sort at twice the floor, on the small machines, and one drive of the rover."""
    rng = np.random.default_rng(seed)
    for machine in SMALL:
        all_of_it = list(_of_machine(machine, seed))
        for cause, count in (("effect", 6), ("parameter", 1), ("sensor", 2), ("none", 2)):
            some = [t for t in all_of_it if t.cause == cause and t.strength in (0.0, 2.0)]
            for k in rng.permutation(len(some))[:count]:
                yield some[int(k)]
    yield Trial(machine="rover", cause="effect", kind="slip_sinkage", target="*", strength=2.0, seed=seed)


def development(seed: int, count: int) -> Iterator[Trial]:
    """Trials to calibrate on: drawn from the small machines, all causes and strengths, with seeds of their own. In one of four diagnosis
    does not know what is wrong: neither that kind of hypothesis nor any at that target.
    """
    rng = np.random.default_rng([DEVELOPMENT, seed])
    everything = [t for machine in SMALL for t in _of_machine(machine, DEVELOPMENT + seed) if t.cause != "none"]
    weights = np.array([3.0 if t.cause in ("sensor", "parameter") else 1.0 for t in everything])
    chosen = rng.choice(len(everything), size=min(count, len(everything)), replace=False, p=weights / weights.sum())
    for n, k in enumerate(chosen):
        trial = everything[int(k)]
        yield replace(trial, seed=CONCEALED + seed) if n % CONCEALED_SHARE == 0 else trial
