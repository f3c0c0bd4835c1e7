"""How well the collision shapes of a rover's bodies fill the parts that they stand for."""

from collections import Counter
from dataclasses import dataclass

from rille.cad.collision.pieces import Piece, union_volume
from rille.model import Part, Rover


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyCollision:
    """Collision shapes of one body.

    kinds : number of pieces by kind. vertices : of its hulls, in all. pieces_volume : of the union of the pieces [m^3].
    parts_volume : of the body's parts [m^3], each in full even where they overlap; 0 where they have none.
    ratio : of the two; None where the body has no pieces or its parts no volume.
    """

    body: str
    kinds: dict[str, int]
    vertices: int
    pieces_volume: float
    parts_volume: float

    @property
    def pieces(self) -> int:
        return sum(self.kinds.values())

    @property
    def ratio(self) -> float | None:
        return self.pieces_volume / self.parts_volume if self.kinds and self.parts_volume > 0 else None


def summarize_collision(rover: Rover) -> list[BodyCollision]:
    """One entry per body, in the rover's order."""
    parts = {part.name: part for part in rover.parts}
    return [
        BodyCollision(
            body=body.name,
            kinds=dict(sorted(Counter(shape.kind for shape in shapes).items())),
            vertices=sum(len(shape.vertices) for shape in shapes if shape.vertices is not None),
            pieces_volume=union_volume([Piece(kind=s.kind, pose=s.pose, size=s.size, vertices=s.vertices) for s in shapes]),
            parts_volume=sum(_volume(parts[i.part]) for i in rover.instances if i.body == body.name),
        )
        for body in rover.bodies
        for shapes in [[shape for shape in rover.collision_shapes if shape.body == body.name]]
    ]


def _volume(part: Part) -> float:
    """Exact volume of a part, or that of its visual meshes where it came without one [m^3]."""
    from rille.cad.collision.closed_mesh import solid_of

    if part.volume > 0:
        return float(part.volume)
    solids = [solid_of(mesh, None) for mesh in part.meshes if mesh.purpose == "visual"]
    return sum(solid.volume for solid in solids if solid is not None and solid.bodies)
