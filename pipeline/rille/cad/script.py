"""Mechanisms in Python: a CadQuery assembly with bodies and joints, accepted wherever a STEP file with a sheet is.

A script defines ``build()``, which returns a :class:`Mechanism` (or a bare ``cadquery.Assembly``, which a sheet then joins)::

    import cadquery as cq
    from rille.cad import Mechanism

    def build():
        arm = cq.Assembly(name="arm")
        arm.add(cq.Workplane().box(40, 40, 20), name="base")
        arm.add(cq.Workplane().box(200, 20, 10), name="link", loc=cq.Location((100, 0, 15)))
        m = Mechanism(arm, default_material="aluminium")
        m.body("base", "arm/base")
        m.body("link", "arm/link")
        m.joint("mount", "fixed", child="base")
        m.joint("shoulder", "hinge", parent="base", child="link", point=[0, 0, "15 mm"], axis=[0, 1, 0], lower="-90 deg", upper="90 deg")
        return m
"""

from typing import Any

from rille.cad.sheet import RoverSheet
from rille.model.sheet import validate_sheet


class Mechanism:
    """An assembly, and the tables of its sheet.

    Every method adds one table; its keywords are the keys of :mod:`rille.cad.sheet`, with the same units and defaults, and are checked
    when the mechanism is built. ``options`` : keys of the sheet itself, such as ``up``, ``default_material``, ``tolerance``.
    """

    def __init__(self, assembly: Any, **options: Any) -> None:
        self.assembly = assembly
        self.tables: dict[str, Any] = dict(options)

    def body(self, name: str, *parts: str, **keys: Any) -> "Mechanism":
        """The instances that move together."""
        return self._add("body", name=name, parts=list(parts), **keys)

    def joint(self, name: str, kind: str, *, child: str, parent: str | None = None, **keys: Any) -> "Mechanism":
        """A hinge, prismatic, fixed or spherical joint; without a parent the world holds the child."""
        return self._add("joint", name=name, kind=kind, child=child, parent=parent, **keys)

    def drive(self, joint: str, mode: str, **keys: Any) -> "Mechanism":
        """What moves a joint."""
        return self._add("drive", joint=joint, mode=mode, **keys)

    def wheel(self, joint: str, **keys: Any) -> "Mechanism":
        """A wheel on a hinge."""
        return self._add("wheel", joint=joint, **keys)

    def differential(self, name: str, **keys: Any) -> "Mechanism":
        """Two hinges whose angles add up to twice their carrier's."""
        return self._add("differential", name=name, **keys)

    def gear(self, name: str, **keys: Any) -> "Mechanism":
        """A gear pair."""
        return self._add("gear", name=name, **keys)

    def loop(self, name: str, **keys: Any) -> "Mechanism":
        """A point that two bodies share."""
        return self._add("loop", name=name, **keys)

    def mass(self, name: str, **keys: Any) -> "Mechanism":
        """A lumped mass."""
        return self._add("mass", name=name, **keys)

    def part(self, match: str, **keys: Any) -> "Mechanism":
        """Material or stated mass of parts."""
        return self._add("part", match=match, **keys)

    def material(self, name: str, **keys: Any) -> "Mechanism":
        """A material of its own."""
        return self._add("material", name=name, **keys)

    def frame(self, name: str, **keys: Any) -> "Mechanism":
        """A named place."""
        return self._add("frame", name=name, **keys)

    def sensor(self, name: str, **keys: Any) -> "Mechanism":
        """A sensor."""
        return self._add("sensor", name=name, **keys)

    def sheet(self) -> RoverSheet:
        """The tables as a checked sheet.

        Raises
        ------
        InputRefused : for a key or value that no sheet has.
        """
        return validate_sheet(self.tables | {"step": "script"}, RoverSheet, "mechanism")

    def _add(self, table: str, **keys: Any) -> "Mechanism":
        self.tables.setdefault(table, []).append({key: value for key, value in keys.items() if value is not None})
        return self
