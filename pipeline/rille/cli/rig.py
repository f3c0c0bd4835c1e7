"""What the verbs of the bench share: wheel, load, soils, effects and measured points from the options."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rille.cli.talk import assignments, say

if TYPE_CHECKING:
    from rille.model import BenchPoints, BenchWheel, Effect, Soil

Columns = Annotated[list[str] | None, typer.Option("--column", help="QUANTITY=COLUMN of the CSV: sinkage=-Z_mm, load=64.7:N; repeatable.")]
Where = Annotated[list[str] | None, typer.Option("--where", help="COLUMN=TEXT that rows of the CSV must have; repeatable.")]
EXAMPLE = "--column sinkage=-Z_mm"


def find_wheel(
    database: Path | None, name: str | None, radius: str | None, width: str | None, grousers: str | None
) -> tuple["BenchWheel", list[tuple]]:
    """The wheel of a database, with what the options say of it changed, and the rows of the effects on it.

    Without a database, or with a radius and a width but no name: the wheel that the options describe, without effects.
    """
    from rille import simulate, store
    from rille.model import BenchWheel, InputRefused, nearest_names

    if database is None:
        return wheel_of(radius, width, grousers), []
    wheels = {wheel.name: wheel for wheel in store.read_rover(database).wheels}
    if not wheels and (radius is None or width is None):
        raise InputRefused(f"'{database}' has no wheel; build a rover into it, or give --radius and --width")
    if name is not None and name not in wheels:
        raise InputRefused(f"'{database}' has no wheel '{name}'; {nearest_names(name, wheels)}")
    if not wheels or (radius is not None and width is not None and name is None):
        return wheel_of(radius, width, grousers), []
    made = wheels[name] if name is not None else next(iter(wheels.values()))
    acting = [e for e in store.read_effects(database) if e.target in ("*", made.name)]
    on_wheel = [replace(e, target="*") for e in acting if store.find_effect_kind(e.kind).target == "wheel"]
    count, height = (made.grouser.count, made.grouser.height) if made.grouser is not None else (0, 0.0)
    wheel = BenchWheel(radius=made.radius, width=made.width, grouser_count=count, grouser_height=height)
    return _changed(wheel, radius, width, grousers), simulate.effect_rows(on_wheel, store.effect_kinds())


def wheel_of(radius: str | None, width: str | None, grousers: str | None) -> "BenchWheel":
    """The wheel that the options describe."""
    from rille.model import BenchWheel, InputRefused
    from rille.model.quantity import to_si

    if radius is None or width is None:
        raise InputRefused('the bench needs a wheel: a database, or --radius "150 mm" --width "165 mm"')
    rim = BenchWheel(radius=to_si(radius, "length", "radius"), width=to_si(width, "length", "width"))
    return _changed(rim, None, None, grousers)


def _changed(wheel: "BenchWheel", radius: str | None, width: str | None, grousers: str | None) -> "BenchWheel":
    """The wheel with what the options say of it."""
    from rille.model import InputRefused
    from rille.model.quantity import to_si

    if radius is not None:
        wheel = replace(wheel, radius=to_si(radius, "length", "radius"))
    if width is not None:
        wheel = replace(wheel, width=to_si(width, "length", "width"))
    if grousers is not None:
        number, cross, size = grousers.partition("x")
        if not cross or not number.strip().isdigit():
            raise InputRefused(f"'{grousers}' says no grousers; write \"24 x 10 mm\"")
        wheel = replace(wheel, grouser_count=int(number), grouser_height=to_si(size.strip(), "length", "height of the grousers"))
    if not 0 <= wheel.grouser_height < wheel.radius:
        raise InputRefused(
            f"height of the grousers is {wheel.grouser_height:g} m; it must be below the radius of the rim, {wheel.radius:g} m: "
            '"24 x 10 mm"'
        )
    return wheel


def find_load(text: str, gravity: float) -> float:
    """A load [N] of ``30 N``, ``30`` or ``5 kg`` under a gravity [m/s^2]."""
    from rille.model import InputRefused
    from rille.model.quantity import to_si

    try:
        return to_si(text, "force", "load")
    except InputRefused as refusal:
        try:
            return to_si(text, "mass", "load") * gravity
        except InputRefused:
            raise refusal from None


def find_soils(database: Path | None, names: list[str] | None) -> list["Soil"]:
    """Soils of a database and the library by name; without names all of the database, else lunar_sourcebook."""
    from rille import store, terrain

    own = {} if database is None else {soil.name: soil for soil in store.read_soils(database)}
    known = dict(terrain.soils()) | own
    names = names or list(own) or ["lunar_sourcebook"]
    return [pick_soil(known, name) for name in names]


def pick_soil(soils: Mapping[str, "Soil"], name: str) -> "Soil":
    """One of the soils by its name."""
    from rille.model import InputRefused, nearest_names

    if name not in soils:
        raise InputRefused(f"there is no soil '{name}'; {nearest_names(name, soils)}")
    return soils[name]


def find_effect(text: str) -> "Effect":
    """The effect that ``slip_sinkage:slip_gain=0.5`` says."""
    from rille import store
    from rille.cli.effects import effect_of, tell_idle_effect

    name, _, rest = text.partition(":")
    effect = effect_of(name, "*", [part for part in rest.split(",") if part])
    store.check_effect(effect)
    tell_idle_effect(effect)
    return effect


def read_points(path: Path, column: list[str] | None, where: list[str] | None, wheel: "BenchWheel") -> "BenchPoints":
    """Measured points of a CSV with the options of the command line; says which rows are copies, and a sinkage beyond the wheel."""
    from rille import simulate
    from rille.model import InputRefused
    from rille.recording.points_gate import buried, too_deep

    def tell(copies: Mapping[int, int]) -> None:
        line, other = next(iter(copies.items()))
        say(f"{len(copies)} rows of '{path}' are copies, which are no repeats and are left out (line {line} is line {other})")

    points = simulate.read_bench_csv(path, assignments(column, EXAMPLE), assignments(where, EXAMPLE), on_copies=tell)
    reach = wheel.radius + wheel.grouser_height
    told = too_deep(points.sinkage, reach)
    if told is not None:
        sentence = f"'{path}' {told}; is its unit right? State it: --column sinkage=NAME:mm"
        if buried(points.sinkage, reach):
            raise InputRefused(sentence)
        say(sentence)
    return points


def tell_columns(path: Path, column: list[str] | None) -> None:
    """Say which columns measured points were read from, and in which units."""
    from rille import simulate

    read = simulate.bench_columns(path, assignments(column, EXAMPLE))
    say(f"read from {path.name}: {', '.join(f'{quantity} = {source}' for quantity, source in read.items())}")


def tell_idle(wheel: "BenchWheel", effects: Sequence[tuple], laws: Iterable[str], soils: Iterable["Soil"]) -> None:
    """Say which of the options do nothing: grousers without their effect, the law of Reece with a soil that has no numbers for it.

    effects : rows of ``simulate.effect_rows``.
    """
    if wheel.grouser_count and not any(row[0].startswith("grouser_") for row in effects):
        say("grousers do nothing by themselves; they thrust with --effect grouser_thrust:efficiency=1 (rille effects show grouser_thrust)")
    bare = [s.name for s in soils if s.reece_cohesive_modulus is None and s.reece_frictional_modulus is None]
    if "reece" in laws and bare:
        say(f"reece is bekker_wong at the wheel's width for {', '.join(bare)}: no reece_cohesive_modulus, no reece_frictional_modulus")
