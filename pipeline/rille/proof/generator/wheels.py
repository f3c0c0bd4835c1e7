"""Wheels of a rover on its ground: forces as functions of their speeds, with the slopes that an implicit step needs.

Frame of a wheel: ``up`` the ground's normal seen in the wheel's plane, ``axle`` to the left, ``ahead`` = axle x up. Speeds: lift along up,
u = r w of the rim, v along ahead of the centre, v_y along axle of the foot, spin about up. Forces of the soil, each against a speed of
its own:

    normal    N(z) - c lift, never negative; c = damping b L, L: length of the contact
    shear     S = (T - T_0)/r on u - v (it drives the wheel ahead and brakes the rim)
    rolling   T_0/r on u, like dry friction against u + v/100
    rut       R = S - D on v, like dry friction against v + u/100
    side      F_y on v_y
    scrub     M on spin, like dry friction

T_0: torque of the same normal stresses at zero slip. So S - R = D and r S + T_0 = T wherever the wheel rolls, and a standing wheel
stands. The hundredth gives a wheel that spins on the spot, or is dragged, its full resistance. Dry friction is F speed/hypot(speed,
``CREEP``).
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rille.model import Effect, InputRefused, PhysicsFailed
from rille.proof.generator.ground import Ground, Ruts
from rille.proof.generator.soil_laws import Contacts, Reaction, contact_length, react, soil_laws
from rille.proof.generator.wheel_bench import soil_columns
from rille.proof.generator.wheel_soil import LOAD, PULL, ROLLING_TORQUE, SIDE, SINKAGE, TORQUE, rolling
from rille.proof.subject import Subject

Array = NDArray[np.float64]
CREEP = 1e-6  # [m/s] of dry friction and of slip: a parked rover creeps by less
SLOW = 5e-3  # [m/s] below which the normal load takes slip against this speed: a wheel that trembles does not turn its shear over
TRAVEL_SHARE = 0.01  # [-]
NORMAL, SHEAR, ROLLING, RUT, SIDEWAYS, SCRUB = range(6)
CELLS_ACROSS = 12  # of a rut, in the narrowest wheel


@dataclass(slots=True, kw_only=True)
class Footing:
    """Wheels in their frames at an instant. up, ahead, axle : (n, 3) in W. sinkage : (n,) [m], negative in the air. contacts : for the
    laws.
    """

    up: Array
    ahead: Array
    axle: Array
    sinkage: Array
    contacts: Contacts


@dataclass(slots=True, kw_only=True)
class Push:
    """Forces (n, 6) [N; scrub N m] along the six speeds, and their slopes (n, 6) >= 0: how they fall per speed, on the chord.

    stiffness : (n,) [N/m] of the normal force, about (exponent + 1/2) N/z. contacts, reaction : as the laws saw and left them.
    """

    force: Array
    slope: Array
    stiffness: Array
    contacts: Contacts
    reaction: Reaction


def _dry(size: Array, speed: Array) -> tuple[Array, Array]:
    """Dry friction of a size against a speed, and its chord."""
    per_speed = size / np.hypot(speed, CREEP)
    return -per_speed * speed, np.maximum(per_speed, 0.0)


class Wheels:
    """All wheels of a machine on its terrain, with laws."""

    def __init__(self, machine: Subject, effects: Sequence[Effect], gravity: float) -> None:
        assert machine.terrain is not None
        wheels = machine.rover.wheels
        self.names = [wheel.name for wheel in wheels]
        self.ground = Ground(machine.terrain)
        self.laws = soil_laws(effects, self.names)
        self.radius, self.width = np.array([w.radius for w in wheels]), np.array([w.width for w in wheels])
        self._grousers = [w.grouser for w in wheels]
        self._materials = [w.material for w in wheels]
        self._gravity = gravity
        self._columns = {k: self._soil_columns([k] * len(wheels)) for k in range(len(machine.terrain.soils))}
        self.ruts = Ruts(float(self.width.min()) / CELLS_ACROSS) if any(law.reads_ruts for law in self.laws) else None

    def _soil_columns(self, soils: Sequence[int]) -> dict[str, Array]:
        terrain = self.ground.terrain
        found = [terrain.soils[k] for k in soils]
        responses = []
        for soil, material in zip(found, self._materials, strict=True):
            pairs = [p for p in terrain.pairs if p.soil == soil.name and p.material in (None, material)]
            response = max(pairs, key=lambda pair: pair.material is not None).response if pairs else "rigid"
            if response == "rigid":
                raise InputRefused(
                    f"wheels are rigid on soil '{soil.name}'; the generator knows soft soil only: give the pair one of its laws"
                )
            responses.append(response)
        return soil_columns(found, responses, self._gravity)

    def footing(self, center: Array, axle: Array, angle: Array) -> Footing:
        """Wheels with their centres (n, 3) and axles (n, 3) in W, turned by angles (n,) [rad].

        Raises
        ------
        PhysicsFailed : if a wheel left the terrain or is buried to its axle.
        """
        heading = np.column_stack([axle[:, 1], -axle[:, 0]])
        heading /= np.hypot(heading[:, 0], heading[:, 1])[:, None]
        place = center[:, :2].copy()
        height, normal = self.ground.plane(place, heading, 0.5 * self.radius, 0.5 * self.width)
        in_plane = normal - np.sum(normal * axle, axis=1, keepdims=True) * axle
        upright = np.sqrt(np.sum(in_plane**2, axis=1))
        up = in_plane / upright[:, None]
        sinkage = self.radius - (center[:, 2] - height) * normal[:, 2] / upright
        if (sinkage >= self.radius).any():
            worst = int(np.argmax(sinkage - self.radius))
            raise PhysicsFailed(f"wheel '{self.names[worst]}' sank to its axle: the soil is too soft for its load")
        n = len(center)
        patches = self.ground.terrain.patches
        columns = self._soil_columns([self.ground.soil(*p) for p in place]) if patches else self._columns[self.ground.soil(*place[0])]
        contacts = Contacts(
            radius=self.radius,
            width=self.width,
            grouser_count=np.array([g.count if g else 0.0 for g in self._grousers]),
            grouser_height=np.array([g.height if g else 0.0 for g in self._grousers]),
            place=place,
            angle=angle,
            rim=np.zeros(n),
            travel=np.zeros(n),
            direction=np.ones(n),
            motion=np.zeros((n, 4)),
            rut_depth=np.zeros(n),
            **columns,
        )
        return Footing(up=up, ahead=np.cross(axle, up).astype(np.float64), axle=axle, sinkage=sinkage, contacts=contacts)

    def read_ruts(self, footing: Footing, rim: Array, travel: Array) -> None:
        """What earlier wheels left where each wheel enters the soil, which it has not touched itself. rim, travel : (n,) [m/s]."""
        if self.ruts is None:
            return
        direction = np.where(np.where(np.abs(rim) >= np.abs(travel), rim, travel) < 0, -1.0, 1.0)
        for k, place in enumerate(footing.contacts.place):
            heading, left = footing.ahead[k, :2] * direction[k], footing.axle[k, :2]
            ratio = np.clip(footing.sinkage[k] / self.radius[k], 0.0, 1.0)
            reach = self.radius[k] * np.sqrt(ratio * (2 - ratio)) + 2 * self.ruts.cell
            footing.contacts.rut_depth[k] = self.ruts.depth(place + reach * heading, left, float(self.width[k]))

    @staticmethod
    def slow(speed: Array) -> NDArray[np.bool_]:
        """Which wheels (n,) hardly roll at speeds (n, 5)."""
        return np.abs(speed[:, 1:4]).max(axis=1) < SLOW

    def push(self, footing: Footing, sinkage: Array, speed: Array, slow: NDArray[np.bool_]) -> Push:
        """Forces at sinkages (n,) [m] and speeds (n, 5): lift, u, v, v_y [m/s], spin [rad/s]. slow : (n,), at the beginning of the step."""
        lift, u, v, v_y, spin = speed.T
        direction, motion = rolling(v, u, v_y, CREEP)
        motion[:, SINKAGE] = sinkage
        contacts = copy(footing.contacts)
        contacts.rim, contacts.travel, contacts.direction, contacts.motion = u, v, direction, motion
        reaction = react(self.laws, contacts)
        table = reaction.table
        load = table[:, LOAD]
        if slow.any():
            still = copy(footing.contacts)
            still.rim, still.travel, still.direction, still.motion = u, v, *rolling(v, u, v_y, SLOW)
            still.motion[:, SINKAGE] = sinkage
            load = np.where(slow, react(self.laws, still).table[:, LOAD], load)
        table[load <= 0] = 0.0
        load = np.maximum(load, 0.0)

        shear = (table[:, TORQUE] - table[:, ROLLING_TORQUE]) / self.radius
        force, slope = np.zeros((len(u), 6)), np.zeros((len(u), 6))
        dashpot = contacts.damping * self.width * contact_length(contacts, table)
        force[:, NORMAL] = np.maximum(load - dashpot * lift, 0.0)
        slope[:, NORMAL] = dashpot
        force[:, SHEAR] = -direction * shear
        slope[:, SHEAR] = np.abs(shear) / np.maximum(np.abs(u - v), 1e-3 * CREEP)
        force[:, ROLLING], slope[:, ROLLING] = _dry(table[:, ROLLING_TORQUE] / self.radius, u + TRAVEL_SHARE * v)
        force[:, RUT], slope[:, RUT] = _dry(shear - table[:, PULL], v + TRAVEL_SHARE * u)
        force[:, SIDEWAYS] = -np.sign(v_y) * table[:, SIDE]
        slope[:, SIDEWAYS] = np.abs(table[:, SIDE]) / np.maximum(np.abs(v_y), 1e-3 * CREEP)
        force[:, SCRUB], slope[:, SCRUB] = _dry(reaction.scrub, spin * self.radius)
        slope[:, SCRUB] *= self.radius
        stiffness = (contacts.sinkage_exponent + 0.5) * load / np.maximum(contacts.motion[:, SINKAGE], 1e-5)
        return Push(force=force, slope=slope, stiffness=stiffness, contacts=contacts, reaction=reaction)

    def advance(self, push: Push, step: float) -> None:
        """Memories of laws after a step [s]."""
        for law in self.laws:
            law.advance(push.contacts, step)

    def memory(self) -> list[Array]:
        """What steps go on from, but for ruts: states of all laws."""
        return [law.state for law in self.laws]

    def remember(self, memory: Sequence[Array]) -> None:
        """Go on from there."""
        for law, state in zip(self.laws, memory, strict=True):
            law.state = state

    def mark(self, footing: Footing) -> None:
        """Ruts where wheels stand."""
        if self.ruts is not None:
            for k, place in enumerate(footing.contacts.place):
                if footing.sinkage[k] > 0:
                    self.ruts.mark(place, footing.axle[k, :2], float(self.width[k]), float(footing.sinkage[k]))
