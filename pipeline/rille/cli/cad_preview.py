"""``rille cad preview``: collision shapes over visual meshes."""

from pathlib import Path
from typing import Annotated

import typer

from rille.cli.places import require_png
from rille.cli.talk import Json, print_json, progress, say


def preview(
    model: Annotated[Path, typer.Argument(help="Database with the model.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Picture (PNG).")] = Path("collision.png"),
    body: Annotated[str | None, typer.Option(help="Show this body only.")] = None,
    as_json: Json = False,
) -> None:
    """Show visual meshes and collision pieces over each other, and per body how many pieces there are and how well they fit.

    Example: rille cad preview rover.db --body wheel_front_left -o wheel.png
    """
    from rille import store
    from rille.cad.collision.summary import summarize_collision
    from rille.view.collision_pictures import draw_collision

    require_png(output)
    rover = store.read_rover(model)
    with progress(f"drawing {model.name}") as update:
        update("measuring", 0.0)
        bodies = [row for row in summarize_collision(rover) if body in (None, row.body)]
        update("drawing", 0.3)
        notes = draw_collision(rover, output, body=body, ratios={row.body: row.ratio for row in bodies})
    if as_json:
        rows = [
            {
                "body": row.body,
                "pieces": row.pieces,
                "kinds": row.kinds,
                "hull_vertices": row.vertices,
                "pieces_volume_m3": row.pieces_volume,
                "parts_volume_m3": row.parts_volume,
                "volume_ratio": row.ratio,
            }
            for row in bodies
        ]
        print_json({"picture": str(output) if output.is_file() else None, "bodies": rows, "notes": notes})
        return
    print(f"{'body':<24} {'pieces':>6}  {'pieces [cm3]':>12} {'parts [cm3]':>12} {'ratio':>7}  kinds")
    for row in bodies:
        kinds = ", ".join(f"{count} {kind}" for kind, count in row.kinds.items()) or "none"
        ratio = "-" if row.ratio is None else f"{row.ratio:.3f}"
        print(f"{row.body:<24} {row.pieces:6d}  {row.pieces_volume * 1e6:12.2f} {row.parts_volume * 1e6:12.2f} {ratio:>7}  {kinds}")
    for note in notes:
        say(note)
    if output.is_file():
        say(f"picture: {output}")
