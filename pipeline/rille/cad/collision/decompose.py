"""Convex collision shapes of a part, by the method that suits it."""

import itertools
import math
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from rille.cad.collision.closed_mesh import Solid, solid_of
from rille.cad.collision.coacd_process import coacd_pieces
from rille.cad.collision.convex import few_vertices, hull_of, outside_by
from rille.cad.collision.cuts import convex_pieces
from rille.cad.collision.pieces import Piece, corners, moved, union_volume
from rille.cad.collision.primitives import smallest_primitive
from rille.cad.collision.sectors import symmetric_pieces
from rille.cad.collision.symmetry import RotationalSymmetry, rotational_symmetry, rotational_symmetry_of_mesh
from rille.model import InputRefused, Mesh, Pose

Array = NDArray[np.float64]

Method = Literal["auto", "primitives", "hull", "coacd", "cuts", "symmetric", "box", "none"]

PRIMITIVE_ERROR = 0.05  # a primitive that is larger by less than this is what the part is
PIECE_ERROR = 0.02  # as much, of a piece that was cut out of a part
HULL_RATIO = 1.15  # a hull that is larger by less than this is good enough
CONCAVE = 1.03  # of the hull's volume: from here the symmetry of a part is looked at
LEAST_ORDER = 6  # of the symmetry that decides how a part is decomposed
MANY_TRIANGLES = 3000
FLAT = 0.01  # of the tolerance: points that stand out of a plane by less are in it
CUTS_FAILED = 0.5  # cuts that leave more than this excess are compared with CoACD, which takes its time
COVERS = 0.98  # of the volume: pieces of CoACD that hold less have lost some of the part
FEW = 8  # pieces that are better than a symmetric decomposition, where they do


@dataclass(frozen=True, slots=True, kw_only=True)
class Decomposition:
    """Convex pieces of a part, in the part's frame.

    method : that was used; more than one joined by "+" where solids of a part were treated apart. volume_ratio : volume of the union
    of the pieces over the exact volume of the part, NaN where either is unknown. outside : how far the part's surface stands out of
    the pieces at most [m]. notes : a sentence for whatever could not be done as asked.
    """

    pieces: tuple[Piece, ...]
    method: str
    volume_ratio: float
    outside: float = 0.0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Wish:
    """What the caller asked for; see :func:`decompose`."""

    tolerance: float
    threshold: float
    concavity: float
    max_hulls: int
    max_vertices: int
    time_limit: float


@dataclass(frozen=True, slots=True)
class _Made:
    """Pieces of one kind of treatment."""

    method: str
    pieces: list[Piece]
    notes: tuple[str, ...] = ()


def decompose(
    part: Any,
    method: Method = "auto",
    *,
    tolerance: float | None = None,
    threshold: float = 0.1,
    concavity: float = 0.05,
    max_hulls: int = 256,
    max_vertices: int = 64,
    time_limit: float = 30.0,
) -> Decomposition:
    """Decompose a part into convex pieces.

    Parameters
    ----------
    part : TopoDS_Shape or :class:`rille.model.Mesh`. The shape gets no triangles.
    method : of decomposing.

        - "auto": the first that fits of one primitive that is larger by at most 5 %; "symmetric" for a concave wheel or another part
          that repeats itself 6 times or more, unless 8 cuts do; the hull if it is larger by less than 15 %; and then solid by solid a
          primitive, a hull, "cuts", or "coacd" where cuts exceed the part by half and CoACD does better.
        - "primitives": the smallest box, cylinder or sphere around every solid. "box": one box, along the axes if that is as good.
        - "hull": one hull. "none": no piece.
        - "cuts": cuts along the planes of reflex edges. "coacd": CoACD (Wei et al. 2022), in a child process.
        - "symmetric": one sector is cut, its pieces are turned round the axis n times, exact copies.
    tolerance : of the triangles that a B-rep is decomposed by [m]; default 1/1000 of half its diagonal. A hull reduced to
        ``max_vertices`` holds the part within it.
    threshold : share by which pieces may exceed the part, for "cuts" and "symmetric".
    concavity : CoACD's threshold, in halves of the part's size.
    max_hulls : largest number of pieces. max_vertices : of a hull, at least 8. time_limit : of CoACD [s].

    Raises
    ------
    InputRefused : for an unknown method and for a limit that is out of its range. No part is refused: notes say what could not be done.
    """
    if method not in get_args(Method):
        raise InputRefused(f"collision method is '{method}'; it must be one of {', '.join(get_args(Method))}")
    for name, value, least in (("max_hulls", max_hulls, 1), ("max_vertices", max_vertices, 8)):
        if value < least:
            raise InputRefused(f"{name} of a collision shape is {value}; it must be at least {least}")
    for name, number in (("tolerance", tolerance), ("threshold", threshold), ("concavity", concavity), ("time_limit", time_limit)):
        if number is not None and not (math.isfinite(number) and number > 0):
            raise InputRefused(f"{name} of a collision shape is {number:g}; it must be above 0")
    if method == "none":
        return Decomposition(pieces=(), method="none", volume_ratio=0.0)
    solid = solid_of(part, tolerance)
    if solid is None:
        return Decomposition(pieces=(), method="none", volume_ratio=math.nan, notes=("the part has no face, so it has no collision shape",))
    wish = _Wish(tolerance or 1e-3 * solid.size, threshold, concavity, max_hulls, max_vertices, time_limit)
    made = _with_open_shells(_by_method(method, part, solid, wish), solid, wish)
    pieces = made.pieces
    hulls = [corners(piece, around=True) for piece in pieces]
    return Decomposition(
        pieces=tuple(pieces),
        method=made.method,
        volume_ratio=union_volume(pieces) / solid.volume if solid.volume > 0 and pieces else math.nan,
        outside=float(outside_by(solid.vertices, hulls).max()) if made.method != "none" else 0.0,
        notes=(*made.notes, *_about_cavities(solid)),
    )


def _by_method(method: str, part: Any, solid: Solid, wish: _Wish) -> _Made:
    if method == "box":
        return _primitive(solid.vertices, solid.volume, wish, ("box",))
    if method == "hull":
        return _hull(solid.vertices, wish)
    if method == "coacd":
        return _coacd(solid.vertices, solid.triangles, wish, _bodies_cut(solid, wish))
    if not solid.bodies:
        return _open(solid, wish)
    if method == "primitives":
        return _joined([_primitive(v, b.volume(), wish) for b in solid.bodies for v in [_points(b)]], solid, wish)
    if method == "cuts":
        return _bodies_cut(solid, wish)
    if method == "symmetric":
        return _symmetric(_symmetry(part), solid, wish) or _with_note(
            _bodies_cut(solid, wish), "the part has no rotational symmetry to decompose it by; it was cut by planes"
        )
    return _auto(part, solid, wish)


def _with_open_shells(made: _Made, solid: Solid, wish: _Wish) -> _Made:
    """Hulls around the surfaces that enclose nothing, where the pieces do not hold them yet."""
    hulls = [corners(piece, around=True) for piece in made.pieces]
    free = [shell for shell in solid.open_shells if outside_by(shell, hulls).max() > 2 * wish.tolerance]
    if not free:
        return made
    more = [piece for shell in free for piece in _hull(shell, wish).pieces]
    note = f"surfaces that enclose nothing ({len(free)}) got hulls around them"
    return _with_note(_Made(made.method, [*made.pieces, *more], made.notes), note)


def _auto(part: Any, solid: Solid, wish: _Wish) -> _Made:
    """See :func:`decompose`."""
    filled = solid.volume + solid.cavities
    primitive = smallest_primitive(solid.vertices, filled)
    if primitive is not None and primitive.error <= PRIMITIVE_ERROR:
        return _Made("primitives", [primitive.piece])
    hull = hull_of(solid.vertices)
    ratio = hull.volume / filled if hull is not None else math.inf
    if ratio > CONCAVE:
        symmetry = _symmetry(part)
        if symmetry is not None and (symmetry.order == 0 or symmetry.order >= LEAST_ORDER or symmetry.round):
            few = _few(solid, wish) if symmetry.grouser_count == 0 else None
            made = few or _symmetric(symmetry, solid, wish)
            if made is not None:
                return made
    if ratio <= HULL_RATIO:
        return _hull(solid.vertices, wish)
    return _joined([_of_body(body, wish) for body in solid.bodies], solid, wish)


def _few(solid: Solid, wish: _Wish) -> _Made | None:
    """A handful of cuts, if they do: a stepped shaft is better as two hulls than as twelve sectors."""
    if len(solid.bodies) > FEW:
        return None
    hulls = [hull for body in solid.bodies for hull in convex_pieces(_simple(body, wish), threshold=wish.threshold, most=FEW)]
    pieces = [piece for hull in hulls for piece in _convex(_points(hull), wish)]
    fits = len(pieces) <= FEW and union_volume(pieces) <= (1 + wish.threshold) * sum(body.volume() for body in solid.bodies)
    return _Made("cuts", pieces) if fits else None


def _simple(body: Any, wish: _Wish) -> Any:
    """The body with fewer triangles, within half the tolerance; within twice of it where there are very many."""
    for share in (0.5, 1.0, 2.0):
        simple = body.simplify(share * wish.tolerance)
        if simple.num_tri() <= MANY_TRIANGLES:
            break
    return simple


def _of_body(body: Any, wish: _Wish) -> _Made:
    """One closed body: a primitive, its hull, cuts, or CoACD where cuts fail and it does better."""
    points, volume = _points(body), body.volume()
    primitive = smallest_primitive(points, volume)
    if primitive is not None and primitive.error <= PRIMITIVE_ERROR:
        return _Made("primitives", [primitive.piece])
    if body.hull().volume() <= HULL_RATIO * volume:
        return _hull(points, wish)
    cut = _cut(body, wish)
    excess = union_volume(cut.pieces) / volume - 1
    if excess <= max(CUTS_FAILED, wish.threshold):
        return cut
    mesh = body.to_mesh64()
    other = _coacd(points, np.array(mesh.tri_verts, np.int64), wish, cut)
    return other if COVERS * volume <= union_volume(other.pieces) < (1 + excess) * volume else cut


def _cut(body: Any, wish: _Wish) -> _Made:
    most = min(wish.max_hulls, 64)
    made = convex_pieces(_simple(body, wish), threshold=wish.threshold, most=most)
    return _Made("cuts", [piece for part in made for piece in _convex(_points(part), wish)])


def _bodies_cut(solid: Solid, wish: _Wish) -> _Made:
    if not solid.bodies:
        return _open(solid, wish)
    return _joined([_cut(body, wish) for body in solid.bodies], solid, wish)


def _symmetry(part: Any) -> RotationalSymmetry | None:
    return rotational_symmetry_of_mesh(part.vertices, part.triangles) if isinstance(part, Mesh) else rotational_symmetry(part)


def _symmetric(symmetry: RotationalSymmetry | None, solid: Solid, wish: _Wish) -> _Made | None:
    """Sectors, turned; None where the part is not symmetric or where the limit of pieces does not suffice."""
    if symmetry is None:
        return None
    found = symmetric_pieces(list(solid.bodies), symmetry, tolerance=wish.tolerance, threshold=wish.threshold, most=wish.max_hulls)
    pieces = []
    for points, poses in found:
        for piece in _convex(points, wish):
            pieces += [moved(piece, rotation, shift) for rotation, shift in poses]
    return _Made("symmetric", pieces) if pieces else None


def _coacd(vertices: Array, triangles: NDArray[np.int64], wish: _Wish, otherwise: _Made) -> _Made:
    found, why_not = coacd_pieces(vertices, triangles, concavity=wish.concavity, most=wish.max_hulls, time_limit=wish.time_limit)
    pieces = [piece for points in found for piece in _convex(points, wish)]
    if pieces:
        return _Made("coacd", pieces)
    return _with_note(otherwise, f"{why_not or 'CoACD found no piece'}; {otherwise.method} was used instead")


def _open(solid: Solid, wish: _Wish) -> _Made:
    """Surfaces that enclose nothing: a hull, CoACD where the hull is far too large."""
    made = _with_note(
        _hull(solid.vertices, wish), "the surface does not close, so nothing is known of its inside: pieces are made around it"
    )
    hull = hull_of(solid.vertices)
    if hull is None or not 0 < solid.volume < hull.volume / HULL_RATIO:
        return made
    other = _coacd(solid.vertices, solid.triangles, wish, made)
    return other if union_volume(other.pieces) >= COVERS * solid.volume else made


def _primitive(points: Array, volume: float, wish: _Wish, kinds: tuple[str, ...] = ("box", "cylinder", "sphere")) -> _Made:
    primitive = smallest_primitive(points, volume, kinds)
    method = "box" if kinds == ("box",) else "primitives"
    if primitive is None or _is_flat(points, wish):
        return _Made(method, *_plate(points, wish))
    return _Made(method, [primitive.piece])


def _convex(points: Array, wish: _Wish) -> list[Piece]:
    """A convex piece that was cut out: a primitive where it is one, else its hull."""
    hull = hull_of(points)
    primitive = None if hull is None else smallest_primitive(points, float(hull.volume))
    if primitive is not None and primitive.error <= PIECE_ERROR:
        return [primitive.piece]
    return _hull(points, wish).pieces


def _hull(points: Array, wish: _Wish) -> _Made:
    vertices = None if _is_flat(points, wish) else few_vertices(points, wish.max_vertices, wish.tolerance)
    if vertices is None:
        return _Made("box", *_plate(points, wish))
    middle = vertices.mean(axis=0)
    x, y, z = map(float, middle)
    return _Made("hull", [Piece(kind="hull", pose=Pose(position=(x, y, z)), vertices=vertices - middle)])


def _is_flat(points: Array, wish: _Wish) -> bool:
    """Whether all points lie in a plane, but for rounding."""
    across = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][-1]
    return bool(np.ptp(points @ across) <= FLAT * wish.tolerance)


def _plate(points: Array, wish: _Wish) -> tuple[list[Piece], tuple[str, ...]]:
    """A box around points in a plane or on a line: as thick as the tolerance."""
    nudge = 0.5 * wish.tolerance * np.array(list(itertools.product((-1, 1), repeat=3)), float)
    # Along the principal axes, so that a plane at any attitude gets a thin box.
    axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2] if len(points) > 2 else np.eye(3)
    thick = (points[:, None] + (nudge @ axes)[None]).reshape(-1, 3)
    primitive = smallest_primitive(thick, 0.0, ("box",))
    assert primitive is not None  # the nudges span a volume
    return [primitive.piece], (f"a flat surface got a box as thick as the tolerance, {wish.tolerance * 1e3:.3g} mm",)


def _joined(parts: list[_Made], solid: Solid, wish: _Wish) -> _Made:
    """Pieces of several bodies as those of one part; the hull of all where there are more than allowed."""
    pieces = [piece for made in parts for piece in made.pieces]
    notes = tuple(dict.fromkeys(note for made in parts for note in made.notes))
    if len(pieces) > wish.max_hulls:
        note = f"{len(pieces)} pieces are more than the {wish.max_hulls} allowed; one hull was used instead"
        return _with_note(_hull(solid.vertices, wish), note)
    return _Made("+".join(sorted({made.method for made in parts})), pieces, notes)


def _with_note(made: _Made, note: str) -> _Made:
    return _Made(made.method, made.pieces, (*made.notes, note))


def _about_cavities(solid: Solid) -> tuple[str, ...]:
    if solid.cavities <= 1e-6 * solid.volume:
        return ()
    return (f"a closed cavity of {solid.cavities * 1e6:.3g} cm^3 counts as full: nothing can get into it",)


def _points(body: Any) -> Array:
    """Corners of a manifold3d.Manifold, shape (n, 3)."""
    return np.array(body.to_mesh64().vert_properties, np.float64)[:, :3]
