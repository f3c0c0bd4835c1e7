"""What a scene holds, read from its sheet without evaluating anything."""

import math
from pathlib import Path
from typing import Any

from rille.model.quantity import to_si
from rille.model.sheet import read_sheet
from rille.terrain.scene import SceneSheet


def contents(scene: Path) -> dict[str, Any]:
    """Name, base, soil, and by kind what is placed, in the order of the file.

    Each entry has its ``name``, ``of`` (what it is), where it has a place ``x_m``, ``y_m``, ``heading_deg``, and ``facts``: the rest in
    words. Landforms also have ``scale``, ``age``, ``soil`` and ``drivers`` as they are written.

    Raises
    ------
    InputRefused : if the scene cannot be read.
    """
    page = read_sheet(scene, SceneSheet)
    kinds: dict[str, list[dict[str, Any]]] = {
        "landform": [
            {
                **_where(sheet, f"landform '{sheet.name}'"),
                "of": sheet.landform,
                "scale": sheet.scale,
                "age": sheet.age,
                "soil": sheet.soil,
                "drivers": sheet.drivers,
                "facts": _words(
                    **({"scale": sheet.scale} if sheet.scale != 1 else {}),
                    **({"age": sheet.age} if sheet.age is not None else {}),
                    **({"soil": sheet.soil} if sheet.soil else {}),
                    **sheet.drivers,
                ),
            }
            for sheet in page.landform
        ],
        "population": [
            {
                "name": sheet.name,
                "of": f"{sheet.landform}s",
                "facts": f"law {sheet.law if isinstance(sheet.law, str) else sheet.law.name}, "
                f"diameter {sheet.diameter[0]} to {sheet.diameter[1]}, seed {sheet.seed}",
            }
            for sheet in page.population
        ],
        "soil_patch": [
            {"name": sheet.name, "of": "soil patch", "facts": f"{sheet.soil}, {len(sheet.polygon)} corners"} for sheet in page.soil_patch
        ],
        "obstacle": [
            {
                **_where(sheet, f"obstacle '{sheet.name}'"),
                "of": sheet.kind,
                "facts": f"obstacle, size {' x '.join(map(str, sheet.size))}",
            }
            for sheet in page.obstacle
        ],
    }
    return {"name": page.name, "base": page.base.kind, "soil": page.soil, "kinds": kinds}


def _where(sheet: Any, subject: str) -> dict[str, Any]:
    return {
        "name": sheet.name,
        "x_m": to_si(sheet.x, "length", f"x of {subject}"),
        "y_m": to_si(sheet.y, "length", f"y of {subject}"),
        "heading_deg": float(f"{math.degrees(to_si(sheet.heading, 'angle', f'heading of {subject}')):.10g}"),
    }


def _words(**facts: Any) -> str:
    return ", ".join(f"{key} {value}" for key, value in facts.items())
