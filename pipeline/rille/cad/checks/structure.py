"""Checks of what refers to what, what hangs on what, and what touches what."""

from collections.abc import Iterator, Mapping

import numpy as np

from rille.cad.checks.body_shape import BodyShape
from rille.cad.checks.finding import Finding
from rille.model import Rover

TOUCH = 1e-4
"""Parts nearer than this [m] besides the tolerances of their meshes touch: play of a clearance fit (ISO 286: up to 0.1 mm below 50 mm)."""


def check_references(rover: Rover) -> Iterator[Finding]:
    """Names that lead nowhere; everything else is checked only when there are none."""
    bodies = {body.name for body in rover.bodies}
    joints = {joint.name for joint in rover.joints}
    if not bodies:
        yield _error("body.none", "model", "the model has no body; add a [[body]] to the sheet and build it again")
    wanted: list[tuple[str, str, str, set[str]]] = []
    for joint in rover.joints:
        wanted.append((f"joint '{joint.name}'", joint.child, "body", bodies))
        if joint.parent is not None:
            wanted.append((f"joint '{joint.name}'", joint.parent, "body", bodies))
    wanted += [(f"drive '{drive.name}'", drive.joint, "joint", joints) for drive in rover.drives]
    wanted += [(f"wheel '{wheel.name}'", wheel.joint, "joint", joints) for wheel in rover.wheels]
    wanted += [(f"gear '{gear.name}'", name, "joint", joints) for gear in rover.gears for name in (gear.joint_a, gear.joint_b)]
    for d in rover.differentials:
        wanted += [(f"differential '{d.name}'", name, "joint", joints) for name in (d.joint_a, d.joint_b)]
        wanted.append((f"differential '{d.name}'", d.carrier, "body", bodies))
    for loop in rover.loop_closures:
        wanted.append((f"loop '{loop.name}'", loop.body_a, "body", bodies))
        if loop.body_b is not None:
            wanted.append((f"loop '{loop.name}'", loop.body_b, "body", bodies))
    wanted += [(f"collision shape {k}", shape.body, "body", bodies) for k, shape in enumerate(rover.collision_shapes)]
    for what, name, kind, known in wanted:
        if name not in known:
            yield _error("reference.unknown", name, f"{what} names the {kind} '{name}', which the model does not have; correct the name")


def check_tree(rover: Rover) -> Iterator[Finding]:
    """One carrier each, no circles, everything connected."""
    carriers: dict[str, list[str]] = {}
    for joint in rover.joints:
        carriers.setdefault(joint.child, []).append(joint.name)
    for body, names in carriers.items():
        if len(names) > 1:
            yield _error(
                "body.two_carriers",
                body,
                f"body '{body}' is the child of {len(names)} joints ({', '.join(names)}), of which a tree allows 1; "
                "turn the others into loop closures",
                value=float(len(names)),
                bound=1.0,
            )
    parent = {joint.child: joint.parent for joint in rover.joints}
    for body in parent:
        seen: list[str] = []
        at: str | None = body
        while at is not None and at not in seen:
            seen.append(at)
            at = parent.get(at)
        if at == body and body == min(seen):
            circle = " <- ".join([*seen, body])
            yield _error("body.circle", body, f"bodies carry each other in a circle ({circle}); turn one of the joints into a loop closure")
    yield from _islands(rover)


def _islands(rover: Rover) -> Iterator[Finding]:
    world = object()
    edges = [(joint.child, joint.parent) for joint in rover.joints] + [(loop.body_a, loop.body_b) for loop in rover.loop_closures]
    groups = _groups([world, *(b.name for b in rover.bodies)], [(a, world if b is None else b) for a, b in edges])
    mass = {body.name: body.properties.mass for body in rover.bodies}
    islands = [[name for name in group if name in mass] for group in groups]
    islands = [island for island in islands if island]
    main = max(islands, key=lambda island: (sum(max(mass[name], 0) for name in island), len(island)), default=[])
    for island in islands:
        if island is main:
            continue
        names = ", ".join(f"'{name}'" for name in island)
        what = f"body {names} is" if len(island) == 1 else f"bodies {names} are"
        yield _error(
            "body.unconnected",
            island[0],
            f'{what} connected with the other {len(main)} by 0 joints; at least 1 is needed: add a [[joint]] (kind = "fixed" if nothing '
            "moves) "
            "or put the parts into another body",
            value=0.0,
            bound=1.0,
        )


def check_contact(shapes: Mapping[str, BodyShape]) -> Iterator[Finding]:
    """Parts of a body that float: no other part of the body within reach."""
    for body, shape in shapes.items():
        pieces = shape.pieces
        if len(pieces) < 2:
            continue
        low = np.array([p.vertices.min(axis=0) for p in pieces])
        high = np.array([p.vertices.max(axis=0) for p in pieces])
        gaps = np.maximum(np.maximum(low[:, None] - high[None, :], low[None, :] - high[:, None]), 0)
        apart = np.linalg.norm(gaps, axis=2)
        allowed = np.array([[TOUCH + a.tolerance + b.tolerance for b in pieces] for a in pieces])
        order = sorted((apart[i, j], i, j) for i in range(len(pieces)) for j in range(i) if apart[i, j] <= allowed[i, j])
        home = list(range(len(pieces)))

        def find(k: int, home: list[int] = home) -> int:
            while home[k] != k:
                k = home[k]
            return k

        for _, i, j in order:
            if find(i) != find(j) and pieces[i].near(pieces[j], float(allowed[i, j])):
                home[find(i)] = find(j)
        groups: dict[int, list[int]] = {}
        for k in range(len(pieces)):
            groups.setdefault(find(k), []).append(k)
        volume = np.prod(high - low, axis=1)
        main = max(groups.values(), key=lambda g: float(volume[g].sum()))
        for group in groups.values():
            if group is main:
                continue
            others = sorted(((i, j) for i in group for j in range(len(pieces)) if j not in group), key=lambda ij: apart[ij])
            distance, i, j = shape.size, *others[0]
            for near in others[:12]:
                if apart[near] >= distance:
                    break
                distance, i, j = min((distance, i, j), (pieces[near[0]].gap(pieces[near[1]], distance), *near))
            bound = float(allowed[i, j])
            more = f" and {len(group) - 1} more" if len(group) > 1 else ""
            yield Finding(
                code="part.floating",
                severity="warning",
                subject=pieces[i].name,
                value=distance,
                bound=bound,
                unit="m",
                sentence=f"part '{pieces[i].name}'{more} of body '{body}' floats: '{pieces[j].name}', the nearest other part of the "
                "body, is "
                f"{distance * 1e3:.4g} mm away (allowed {bound * 1e3:.3g} mm); move it to the body that it is fixed to, or correct its "
                "place",
            )


def _groups(names: list, edges: list[tuple]) -> list[list]:
    home = {name: {name} for name in names}
    for a, b in edges:
        if a in home and b in home and home[a] is not home[b]:
            joined = home[a] | home[b]
            for name in joined:
                home[name] = joined
    found: list[list] = []
    for name in names:
        if not any(name in group for group in found):
            found.append([other for other in names if other in home[name]])
    return found


def _error(code: str, subject: str, sentence: str, value: float | None = None, bound: float | None = None) -> Finding:
    return Finding(code=code, severity="error", subject=subject, value=value, bound=bound, unit="", sentence=sentence)
