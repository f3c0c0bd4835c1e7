"""``rille terrain list | show | register``: the landforms that can be placed."""

from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rille.cli.places import require_png
from rille.cli.talk import Json, assignments, number, print_json, progress, say

if TYPE_CHECKING:
    from rille.terrain.landform import Driver
    from rille.terrain.own.keeping import Kept

Library = Annotated[list[Path] | None, typer.Option("--library", help="A further folder with own landforms; may be given again.")]

SHEET_PICTURE = "pictures/register.png"


def list_register(folders: Sequence[Path], as_json: bool) -> None:
    """Print the registered landforms with their drivers; those that are broken are told on stderr."""
    from rille.terrain.document import describe, range_text, traits
    from rille.terrain.register import read_register

    register = read_register(folders)
    if as_json:
        facts = {name: describe(form, name not in register.builtin) for name, form in register.landforms.items()}
        print_json(facts | {name: facts.get(name, {}) | {"broken": sentence} for name, sentence in register.broken.items()})
    else:
        for name, form in register.landforms.items():
            own = "" if name in register.builtin else "own; "
            print(f"{name}: {form.meaning} ({own}{traits(form)})")
            width = max((len(driver.name) for driver in form.drivers), default=0)
            for driver in form.drivers:
                print(f"    {driver.name:<{width}}  {range_text(driver)}; {_default(driver)}; {driver.meaning}")
    for name, sentence in register.broken.items():
        say(f"note: the own landform '{name}' is left out: {sentence}")


def document(folder: Path, as_json: bool) -> None:
    """Write README.md and pictures of the built-in landforms into a folder."""
    from rille.model import InputRefused
    from rille.terrain.document import page
    from rille.terrain.exhibit import exhibit
    from rille.terrain.register import read_register
    from rille.view.landform_pictures import draw_landform, draw_register

    register = read_register()
    forms = {name: form for name, form in register.landforms.items() if name in register.builtin}
    pictures = {name: f"pictures/{name}.png" for name in forms}
    shown = []
    with progress("drawing landforms") as update:
        for count, (name, form) in enumerate(forms.items()):
            update(name, count / len(forms))
            shown.append(exhibit(form, register.landforms))
            draw_landform(shown[-1], folder / pictures[name])
        draw_register(shown, folder / SHEET_PICTURE)
    try:
        (folder / "README.md").write_text(page(register, pictures, SHEET_PICTURE), encoding="utf-8")
    except OSError as error:
        raise InputRefused(f"'{folder / 'README.md'}' could not be written: {error.strerror}") from None
    if as_json:
        print_json({"page": str(folder / "README.md"), "pictures": [str(folder / path) for path in (*pictures.values(), SHEET_PICTURE)]})
    else:
        say(f"{folder}: README.md and {len(pictures) + 1} pictures of {len(pictures)} landforms")


def show(
    name: Annotated[str, typer.Argument(help="Name of the landform; `rille terrain list` has them all.")],
    drivers: Annotated[list[str] | None, typer.Option("--set", help="DRIVER=VALUE, for example diameter=12m; may be given again.")] = None,
    picture: Annotated[Path | None, typer.Option("--output", "-o", help="Also draw it: a PNG with plan and profile.")] = None,
    library: Library = None,
    as_json: Json = False,
) -> None:
    """Say everything about one landform, with the values that its drivers take; draw it.

    Example: rille terrain show crater --set diameter=40m -o crater.png
    """
    from rille.terrain.document import describe, range_text, traits
    from rille.terrain.exhibit import exhibit
    from rille.terrain.register import read_register
    from rille.view.landform_pictures import draw_landform

    require_png(picture)
    register = read_register(library or ())
    form = register.find(name, "what is to be shown")
    given: dict[str, object] = {key: number(text) for key, text in assignments(drivers, "diameter=12m").items()}
    shown = exhibit(form, register.landforms, given)
    half_x, half_y = form.footprint(shown.values)
    if picture is not None:
        draw_landform(shown, picture)
    low, high = float(shown.heights.min()), float(shown.heights.max())
    if as_json:
        facts: dict[str, Any] = describe(form, name not in register.builtin) | {
            "file": str(register.files[name]),
            "values": shown.values,
            "footprint_m": [2 * half_x, 2 * half_y],
            "heights_m": [low, high],
            "picture": None if picture is None else str(picture),
        }
        print_json(facts)
        return
    print(f"{name}: {form.meaning}")
    print(f"  frame      {form.frame}")
    print(f"  ground     {traits(form)}")
    print(f"  source     {form.source}")
    print(f"  file       {register.files[name]}")
    print(f"  footprint  {2 * half_x:.4g} m x {2 * half_y:.4g} m, heights {low:.4g} to {high:.4g} m on flat ground, with these drivers:")
    width = max((len(key) for key, _ in shown.drivers), default=0)
    for driver, (key, text) in zip(form.drivers, shown.drivers, strict=True):
        print(f"    {key:<{width}} = {text:<10}  {driver.meaning}")
        why = f" ({driver.reason})" if driver.reason else ""
        for more in (f"{_default(driver)}; {range_text(driver)}{why}", driver.source):
            print(f"    {'':<{width + 15}}{more}" if more else "", end="\n" if more else "")
    if picture is not None:
        say(f"wrote {picture}")


def register(
    file: Annotated[Path | None, typer.Argument(help="TOML profile, height map (any raster of GDAL), mesh or STEP file.")] = None,
    name: Annotated[str | None, typer.Option(help="Name; default: that of the file.")] = None,
    kind: Annotated[str | None, typer.Option(help="profile, heights or solid, where the file's ending does not tell.")] = None,
    meaning: Annotated[str | None, typer.Option(help="What it is, in a few words.")] = None,
    source: Annotated[str | None, typer.Option(help="Where it comes from.")] = None,
    blend: Annotated[str | None, typer.Option(help="add, replace, max or drape; default: add, of a solid max.")] = None,
    soil: Annotated[str, typer.Option(help="Soil of its surface; default: that of the ground.")] = "",
    unit: Annotated[str | None, typer.Option(help="Unit of a mesh's coordinates, or of a map's values: mm, m, 0.5 mm.")] = None,
    height_range: Annotated[str | None, typer.Option(help='Map of grey levels: heights of black and white, "0 m, 12 m".')] = None,
    posting: Annotated[str | None, typer.Option(help="Map: distance of its heights. Solid: of those that are made of it.")] = None,
    length: Annotated[str | None, typer.Option(help="Map: from its western to its eastern border, instead of --posting.")] = None,
    origin: Annotated[
        str, typer.Option(help='centre; a map: corner, "pixel 12, 30", "x, y"; a solid: coordinates (of its file), "x, y".')
    ] = "centre",
    zero: Annotated[
        str | None, typer.Option(help="Height zero. Map: border, plane, lowest, a height. Solid: bottom, centre, coordinates, a height.")
    ] = None,
    fade: Annotated[str | None, typer.Option(help="Map: width along its border over which it fades out; default: a tenth.")] = None,
    up: Annotated[str | None, typer.Option(help="Solid: axis that points up: z, -y, ...; default z, of glTF y. Of y, x stays x.")] = None,
    embed: Annotated[str | None, typer.Option(help="Solid: how deep its height zero lies below the ground.")] = None,
    into: Annotated[
        Path | None, typer.Option("--library", help="Folder that takes it; default: RILLE_LANDFORMS, else ~/.local/share/rille/landforms.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace one of that name.")] = False,
    remove: Annotated[str | None, typer.Option(help="Take the landform of this name out of the library instead.")] = None,
    as_json: Json = False,
) -> None:
    """Take an own landform into a library, so that scenes can place it: no programming is needed.

    A profile is a TOML file (terrain_library/own.md shows the three kinds); a height map or a solid becomes a grid of heights.
    A scene finds the default library by itself, other folders by its key `library`.

    Example: rille terrain register outcrop.stl --unit mm --embed 20cm --meaning "outcrop scanned in the yard"
    """
    from rille.model import InputRefused
    from rille.terrain import own

    folder = into or own.own_folder()
    if remove is not None:
        gone = own.remove(remove, folder)
        print_json({"removed": remove, "file": str(gone)}) if as_json else say(f"'{remove}' is no longer in {folder}")
        return
    if file is None:
        raise InputRefused("nothing to register: name a TOML profile, a height map, a mesh or a STEP file")
    if not file.is_file():
        raise InputRefused(f"there is no file '{file}'")
    if blend not in (None, "add", "replace", "max", "drape"):
        raise InputRefused(f"--blend is '{blend}'; it must be add, replace, max or drape")
    what = _kind(file, kind)
    options = {
        "meaning": (meaning, "heights solid"),
        "source": (source, "heights solid"),
        "blend": (blend, "heights solid"),
        "soil": (soil or None, "heights solid"),
        "unit": (unit, "heights solid"),
        "height-range": (height_range, "heights"),
        "posting": (posting, "heights solid"),
        "length": (length, "heights"),
        "origin": (None if origin == "centre" else origin, "heights solid"),
        "zero": (zero, "heights solid"),
        "fade": (fade, "heights"),
        "up": (up, "solid"),
        "embed": (embed, "solid"),
    }
    for option, (value, kinds) in options.items():
        if value is not None and what not in kinds.split():
            where = "write it into the file" if what == "profile" else f"it belongs to {' and '.join(kinds.split())}"
            raise InputRefused(f"--{option} means nothing for '{file}', which is taken as {what}; {where}")
    terms = {"folder": folder, "name": name, "replace": force} | _taken()
    notes: tuple[str, ...] = ()
    if what == "profile":
        kept = own.keep_profile(file, **terms)
    else:
        with progress(f"reading {file.name}") as update:
            if what == "heights":
                stated = own.Georeference(
                    unit=unit, height_range=height_range, posting=posting, length=length, origin=origin, zero=zero or "border", fade=fade
                )
                relief = own.read_height_map(file, stated)
            else:
                vertices, triangles, default_up = _triangles(file, unit, update)
                relief = own.heights_of_solid(
                    vertices,
                    triangles,
                    subject=f"'{file}'",
                    up=up or default_up,
                    origin=origin,
                    zero=zero or "bottom",
                    embed=embed,
                    posting=posting,
                )
        notes = relief.notes
        texts = {"meaning": meaning, "source": source, "blend": blend, "soil": soil}
        kept = own.keep_heights(relief, made_from=file, **texts, **terms)
    _tell(kept, what, notes, as_json)


def _tell(kept: "Kept", what: str, notes: tuple[str, ...], as_json: bool) -> None:
    from rille.terrain.document import range_text

    form = kept.landform
    if as_json:
        facts = {"landform": form.name, "file": str(kept.file), "kind": what, "replaced": kept.replaced, "notes": list(notes)}
        drivers = [{"name": d.name, "unit": d.unit, "lower": d.lower, "upper": d.upper, "default": d.default} for d in form.drivers]
        print_json(facts | {"drivers": drivers, "blend": form.blend})
        return
    for note in notes:
        say(f"note: {note}")
    say(f"{'replaced' if kept.replaced else 'registered'} '{form.name}' in {kept.file}")
    for driver in form.drivers:
        say(f"    {driver.name}: {range_text(driver)}; {_default(driver)}; {driver.meaning}")
    say(f"look at it: rille terrain show {quote(form.name)} -o {quote(form.name + '.png')}")


def _taken() -> dict[str, Any]:
    """What own landforms must agree with: names of the built-in ones, soils."""
    from rille.terrain.register import read_register, soils

    return {"builtin": read_register().builtin, "soils": frozenset(soils())}


STEP_SUFFIXES = (".step", ".stp")


def _kind(file: Path, stated: str | None) -> str:
    from rille.model import InputRefused
    from rille.terrain.own import MESH_SUFFIXES

    if stated is not None:
        if stated not in ("profile", "heights", "solid"):
            raise InputRefused(f"--kind is '{stated}'; it must be profile, heights or solid")
        return stated
    suffix = file.suffix.lower()
    return "profile" if suffix == ".toml" else "solid" if suffix in (*MESH_SUFFIXES, *STEP_SUFFIXES) else "heights"


def _triangles(file: Path, unit: str | None, update: Any) -> tuple[Any, Any, str]:
    """Vertices [m], triangles, and the axis that points up unless another is stated."""
    from rille.terrain import own

    if file.suffix.lower() not in STEP_SUFFIXES:
        return *own.read_triangles(file, unit), own.up_axis(file)
    import numpy as np

    from rille import cad
    from rille.model import InputRefused

    if unit is not None:
        raise InputRefused(f"--unit means nothing for '{file}': a STEP file states its unit")
    assembly = cad.load_assembly(file, progress=lambda what, f: update(what, 0.6 * f), note=lambda sentence: say(f"note: {sentence}"))
    corners = [p.bounds for p in assembly.prototypes if np.isfinite(p.bounds).all()]
    size = max((float(np.ptp(b, axis=0).max()) for b in corners), default=0.0)
    if not size > 0:
        raise InputRefused(f"'{file}' holds no surface")
    meshes = cad.meshes_of(assembly.prototypes, size / 2000, progress=lambda what, f: update(what, 0.6 + 0.4 * f))
    vertices, triangles, count = [], [], 0
    for instance in assembly.instances:
        mesh = meshes[instance.prototype]
        if mesh is None:
            continue
        vertices.append(mesh.vertices @ instance.matrix[:3, :3].T + instance.matrix[:3, 3])
        triangles.append(np.asarray(mesh.triangles, np.int64) + count)
        count += len(mesh.vertices)
    if not count:
        raise InputRefused(f"'{file}' holds no surface")
    return np.concatenate(vertices), np.concatenate(triangles), "z"


def _default(driver: "Driver") -> str:
    from rille.terrain.document import default_text

    text = default_text(driver)
    return text if driver.required or driver.link is not None else f"default {text}"
