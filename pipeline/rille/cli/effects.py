"""``rille effects``: the catalogue, and the effects of a model."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rille.cli.talk import Json, assignments, print_json, say

if TYPE_CHECKING:
    from rille.model import Effect

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Physics beyond the base model: what there is, and what a model has.\n\nExample: rille effects list",
)
Database = Annotated[Path, typer.Argument(help="Database with the model.")]


@app.command("list")
def list_(
    database: Annotated[Path | None, typer.Argument(help="Show the effects of this model instead of the catalogue.")] = None,
    as_json: Json = False,
) -> None:
    """The catalogue; with a database, the effects that its model has.

    Example: rille effects list
    Example: rille effects list rover.db
    """
    from rille import store

    if database is not None:
        effects = store.read_effects(database)
        if as_json:
            print_json([effect.as_dict() for effect in effects])
            return
        for effect in effects:
            print(f"{effect.kind:20s} {effect.target:20s} {', '.join(f'{k} = {v}' for k, v in effect.parameters.items())}")
        if not effects:
            say(f"{database} has the base model only; add an effect with `rille effects add`")
        return
    kinds = store.effect_kinds()
    if as_json:
        print_json([_facts(kind) for kind in kinds])
        return
    family = ""
    for kind in kinds:
        if kind.family != family:
            family = kind.family
            print(f"{family}")
        print(f"  {kind.name:20s} {kind.target:8s} {kind.meaning}")


def _facts(kind) -> dict:
    facts = {f: getattr(kind, f) for f in ("name", "family", "target", "passive", "channel", "equation", "meaning", "source")}
    facts["parameters"] = [{f: getattr(p, f) for f in p.__dataclass_fields__} for p in kind.parameters]
    return facts


@app.command("show")
def show(name: Annotated[str, typer.Argument(help="Name of the effect.")], as_json: Json = False) -> None:
    """One law: its equation, parameters with bounds, source.

    Example: rille effects show slip_sinkage
    """
    from rille import store

    kind = store.find_effect_kind(name)
    if as_json:
        print_json(_facts(kind))
        return
    print(f"{kind.name}: {kind.meaning}")
    print(f"  law       {kind.equation}")
    print(f"  acts on   {kind.target}{'; can only take energy out' if kind.passive else ''}")
    print(f"  seen in   {kind.channel}")
    print(f"  source    {kind.source}")
    for p in kind.parameters:
        role = "amplitude" if p.amplitude else "parameter"
        print(f"  {role:9s} {p.name} [{p.unit}]: {p.meaning}; {p.lower:g} to {p.upper:g}, usually {p.typical:g} +- {p.spread:g}")
    if kind.name == "expression":
        print('  also      formula, output ("joint.effort", "wheel.drawbar_pull", "part.force_x" ...), target_kind (wheel, joint or body),')
        print('            constants, for example --set \'constants={"k": [0.2, "N m s/rad"]}\'')


@app.command("add")
def add(
    database: Database,
    name: Annotated[str, typer.Argument(help="Name of the effect.")],
    target: Annotated[str, typer.Option(help="Name of the wheel, joint, body or sensor; * = every one.")] = "*",
    values: Annotated[list[str] | None, typer.Option("--set", help="PARAMETER=VALUE in SI, repeatable.")] = None,
    as_json: Json = False,
) -> None:
    """Give the model an effect; the same law on the same target is replaced (but expressions, which may be many).

    Example: rille effects add rover.db slip_sinkage --set slip_gain=0.5
    """
    from rille import store

    effect = effect_of(name, target, values or [])
    store.add_effect(database, effect)
    if as_json:
        print_json({"kind": effect.kind, "target": effect.target, "parameters": effect.parameters})
    else:
        say(f"{name} acts on {target} in {database}")
        tell_idle_effect(effect)
        if target == "*" and _has_no(database, store.find_effect_kind(name).target):
            say(f"the model has no {store.find_effect_kind(name).target} yet: until it has, {name} acts on nothing")


def _has_no(database: Path, target: str) -> bool:
    """Whether the model lacks what a law acts on."""
    from rille import store

    rover = store.read_rover(database)
    targets = {"wheel": rover.wheels, "joint": rover.joints, "body": rover.bodies}
    return target in targets and not targets[target]


def effect_of(name: str, target: str, texts: list[str]) -> "Effect":
    """The effect that the options describe; an expression without a gain is as written."""
    from rille.model import Effect

    values = parse_values(texts)
    return Effect(kind=name, target=target, parameters={"gain": 1.0, **values} if name == "expression" else values)


def tell_idle_effect(effect: "Effect") -> None:
    """Say that an effect whose amplitudes are all 0 does nothing, and how large they usually are."""
    from rille import store

    amplitudes = [p for p in store.find_effect_kind(effect.kind).parameters if p.amplitude]
    if amplitudes and not any(effect.parameters.get(p.name) for p in amplitudes):
        usual = " ".join(f"--set {p.name}={p.typical:g}" for p in amplitudes)
        names = " and ".join(p.name for p in amplitudes) + (" is" if len(amplitudes) == 1 else " are")
        say(f"{effect.kind} does nothing while {names} 0; usual is {usual} (SI)")


def parse_values(texts: list[str]) -> dict[str, object]:
    """``a=1`` to ``{"a": 1.0}``; what is no number is read as JSON, else as text."""
    values: dict[str, object] = {}
    for key, value in assignments(texts, "slip_gain=0.5").items():
        try:
            values[key] = float(value)
        except ValueError:
            try:
                values[key] = json.loads(value)
            except json.JSONDecodeError:
                values[key] = value
    return values


@app.command("remove")
def remove(
    database: Database,
    name: Annotated[str | None, typer.Argument(help="Name of the effect; default: all.")] = None,
    target: Annotated[str | None, typer.Option(help="Only those on this target.")] = None,
    as_json: Json = False,
) -> None:
    """Take effects out of the model.

    Example: rille effects remove rover.db slip_sinkage
    """
    from rille import store
    from rille.model import InputRefused

    present = store.read_effects(database)
    kept = [e for e in present if (name is not None and e.kind != name) or (target is not None and e.target != target)]
    if name is not None:
        store.find_effect_kind(name)
    if len(kept) == len(present) and (name is not None or target is not None):
        has = ", ".join(f"{e.kind} on {e.target}" for e in present) or "none"
        raise InputRefused(f"'{database}' has no effect {name or ''}{f' on {target}' if target is not None else ''}; it has {has}")
    store.write_effects(database, kept)
    if as_json:
        print_json({"removed": len(present) - len(kept), "left": len(kept)})
    else:
        say(f"{len(present) - len(kept)} effects removed, {len(kept)} left in {database}")
