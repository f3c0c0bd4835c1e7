"""What geometry tells about a mechanism: bodies, joints and wheels, each with its evidence and a confidence.

Rigid groups (``grouping``), joints between them (``joint_evidence``) and wheels (``wheel_search``) become one tree here: what is under
``THRESHOLD`` is taken for rigid, what closes a circle is set aside. Where the machine stands on wheels that nothing hinges
(``unheld_wheels``), all is judged once more with a hinge for each of them.
"""

import math
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rille.cad.files.assembly import Assembly, require_solids
from rille.cad.suggestion.contact import Contact, PlacedSolid, coaxial, facing, find_contacts, near_pairs, place_solids, seat_balls
from rille.cad.suggestion.grouping import SMALL, Grouping, Line
from rille.cad.suggestion.joint_evidence import Candidate, JointEvidence
from rille.cad.suggestion.mobility import positive
from rille.cad.suggestion.outward import outward
from rille.cad.suggestion.unheld_wheels import UnheldWheel, unheld_wheels, without_holders
from rille.cad.suggestion.values import THRESHOLD, SuggestedBody, SuggestedJoint, SuggestedWheel, Suggestions
from rille.cad.suggestion.wheel_search import Wheel, WheelSearch
from rille.cad.suggestion.wording import mm
from rille.model import InputRefused

Array = NDArray[np.float64]


def suggest(assembly: Assembly, progress: Callable[[str, float], None] | None = None) -> Suggestions:
    """Suggest bodies, joints and wheels of an assembly from its geometry alone; the same file gives the same suggestions.

    Raises
    ------
    InputRefused : if the assembly has no closed solid, or none that can be tessellated.
    """
    require_solids(assembly)
    say = progress or (lambda what, fraction: None)
    solids = place_solids(assembly, lambda what, f: say(what, 0.4 * f))
    if not solids:
        raise InputRefused(f"no solid of '{assembly.file}' can be tessellated; check its geometry in CAD and export it again")
    contacts = seat_balls(solids, find_contacts(solids, lambda what, f: say(what, 0.4 + 0.4 * f)))
    say("grouping", 0.8)
    judge = _Judge(assembly, _grouped(solids, contacts))
    result = judge.result(lambda what, f: say(what, 0.85 + 0.1 * f))
    unheld = unheld_wheels(judge.wheels, result.accepted)
    if unheld:
        judge = _Judge(assembly, _grouped(solids, contacts, unheld), unheld, judge.wheels)
        result = judge.result(lambda what, f: say(what, 0.95 + 0.05 * f))
    say("done", 1.0)
    return result


def _grouped(solids: list[PlacedSolid], contacts: list[Contact], unheld: Sequence[UnheldWheel] = ()) -> Grouping:
    """Rigid groups; each wheel without a bearing is one, apart from what carries it."""
    grouping = Grouping(solids, without_holders(unheld, contacts))
    for wheel in unheld:
        for solid in wheel.solids:
            grouping.merge(min(wheel.solids), solid)
    grouping.solve()
    return grouping


class _Judge:
    """From rigid groups to suggestions."""

    def __init__(
        self, assembly: Assembly, grouping: Grouping, unheld: Sequence[UnheldWheel] = (), wheels: WheelSearch | None = None
    ) -> None:
        self.assembly = assembly
        self.g = grouping
        self.unheld = unheld
        self.notes: list[str] = []
        self.assumed: dict[int, list[str]] = defaultdict(list)
        self.joints = JointEvidence(assembly, grouping)
        self.wheels = WheelSearch(assembly, grouping, wheels)
        self.candidates: list[Candidate] = []

    def result(self, say: Callable[[str, float], None]) -> Suggestions:
        self.candidates = [c for a, b in self.g.pairs() if (c := self.joints.candidate(a, b)) is not None]
        self._hold_wheels()
        self._hold_floating()
        say("wheels", 0.3)
        self._wheels()
        self._compare()
        say("tree", 0.9)
        return self._suggestions()

    # --- what nothing holds

    def _hold_wheels(self) -> None:
        """Hinge wheels without a bearing to their nearest neighbours."""
        wheels = set().union(*(w.solids for w in self.unheld))
        others = [j for j in range(len(self.g.bodies)) if j not in wheels]
        for wheel in self.unheld:
            nearest = self._nearest(wheel.solids, others)
            a = self.g.group[min(wheel.solids)]
            if nearest is not None and not any(a in (c.a, c.b) for c in self.candidates):  # two wheels of one axle have one hinge
                *_, i, j = nearest
                self.candidates.append(self.joints.unheld(a, self.g.group[j], wheel.line, i, j))

    def _hold_floating(self) -> None:
        """Find for every part of the machine that nothing touches what holds it across a gap, else join it to its nearest neighbour."""
        while True:
            islands = self._islands()
            if len(islands) < 2:
                return
            main = max(islands, key=lambda groups: sum(self.g.volume(k) for k in groups))
            for island in sorted((x for x in islands if x is not main), key=lambda x: (sum(self.g.volume(k) for k in x), min(x))):
                if not self._bridge(island, islands):
                    self._join_nearest(island)
                break

    def _islands(self) -> list[set[int]]:
        """Groups that contacts or candidates hold together."""
        linked: dict[int, set[int]] = defaultdict(set)
        for c in self.candidates:
            linked[c.a].add(c.b)
            linked[c.b].add(c.a)
        for a, b in self.g.pairs():
            linked[a].add(b)
            linked[b].add(a)
        return self._connected(linked)

    def _connected(self, linked: dict[int, set[int]]) -> list[set[int]]:
        left, found = set(self.g.members), []
        while left:
            todo, island = [min(left)], set()
            while todo:
                group = todo.pop()
                if group in left:
                    left.remove(group)
                    island.add(group)
                    todo += linked[group]
            found.append(island)
        return found

    def _bridge(self, island: set[int], islands: list[set[int]]) -> bool:
        """A shaft in a wider hole, or a round end before a flat, across a gap: what is between is not drawn."""
        mine = [i for k in island for i in self.g.members[k]]
        size = max(self.g.extent(k) for k in island)
        if size < SMALL * self.g.size:
            return False
        near = [(i, j) for i, j in near_pairs(self.g.bodies, 0.1 * size) if (i in set(mine)) != (j in set(mine))]
        best: tuple[float, Candidate] | None = None
        for i, j in near:
            a, b = self.g.group[i], self.g.group[j]
            one, other = self.g.bodies[i], self.g.bodies[j]
            for fit in coaxial(self.g.bodies, i, j):
                score = 2.0 - fit.clearance / fit.hole
                if best is None or score > best[0]:
                    best = (score, self.joints.wide_fit(a, b, i, j, fit))
            for face in facing(one, other, 0.1 * size):
                if face.gap > 0.3 * face.round_radius or face.area < 0.5 * math.pi * face.round_radius**2:
                    continue
                score = (1.0 if face.both_round else 0.5) - face.gap / face.round_radius
                if best is None or score > best[0]:
                    best = (score, self.joints.butt(a, b, face))
        if best is None:
            return False
        best[1].found.append(("nothing else", "nothing touches what it carries, so it must be held here, by something that is not drawn"))
        self.candidates.append(best[1])
        return True

    def _join_nearest(self, island: set[int]) -> None:
        mine = [i for k in island for i in self.g.members[k]]
        inside = set(mine)
        others = [i for i in range(len(self.g.bodies)) if i not in inside]
        nearest = self._nearest(mine, others)
        if nearest is None:
            return
        gap, _, i, j = nearest
        kept = self.g.group[j]
        between = f"{mm(gap)} between their boxes"
        if self.g.bodies[i].instance == self.g.bodies[j].instance:
            sentence = (
                f"two solids of {self.joints.path(i)} do not touch ({between}) and move together, since they are drawn as one part; "
                "if they move against each other, make them two parts in CAD"
            )
        else:
            sentence = f"nothing holds {self.joints.path(i)}; it was put with {self.joints.path(j)}, its nearest neighbour ({between})"
        self._merge(self.g.group[i], kept)
        self.assumed[self.g.group[j]].append(sentence)
        self.notes.append(sentence)

    def _common_path(self, i: int, j: int) -> int:
        one, other = self.g.bodies[i].path.split("/"), self.g.bodies[j].path.split("/")
        return next((k for k, (x, y) in enumerate(zip(one, other, strict=False)) if x != y), min(len(one), len(other)))

    def _nearest(self, mine: Iterable[int], others: Sequence[int]) -> tuple[float, int, int, int] | None:
        """The nearest of ``others`` to some solids: (distance of the boxes [m], - length of the common path, one of ``mine``, that one); of
        as near ones one of the same sub-assembly. None without others.
        """
        return min(((self._apart(i, j), -self._common_path(i, j), i, j) for i in mine for j in others), default=None)

    def _apart(self, i: int, j: int) -> float:
        one, other = self.g.bodies[i], self.g.bodies[j]
        return float(np.linalg.norm(np.maximum(0, np.maximum(one.low - other.high, other.low - one.high))))

    def _merge(self, a: int, b: int) -> None:
        """Make two groups one, and keep the candidates right."""
        one, other = self.g.group[a], self.g.group[b]
        kept = self.g.merge(one, other)
        gone = other if kept == one else one
        if gone in self.assumed:
            self.assumed[kept] += self.assumed.pop(gone)
        for c in self.candidates:
            c.a, c.b = (kept if c.a == gone else c.a), (kept if c.b == gone else c.b)
        self.candidates = [c for c in self.candidates if c.a != c.b]

    # --- wheels

    def _wheels(self) -> None:
        degree = Counter(k for c in self.candidates for k in (c.a, c.b))
        found: list[tuple[Candidate, Wheel]] = []
        for c in self.candidates:
            if c.kind != "hinge":
                continue
            leaves = [k for k in (c.a, c.b) if degree[k] == 1]
            wheels = [w for k in leaves if (w := self.wheels.find(k, c.other(k), Line(point=c.point, axis=c.axis), c.radius)) is not None]
            if wheels:
                best = max(wheels, key=lambda w: (w.symmetry.radius, -self.g.volume(w.group)))
                found.append((c, best))
        for c, wheel in found:
            self.wheels.judge(wheel, [w for _, w in found])
            if wheel.confidence >= THRESHOLD:
                c.found.append(("wheel", f"carries a wheel of diameter {mm(2 * wheel.symmetry.rim_radius)} on its axis"))
                c.point = wheel.center
                self._tell_of_axle(wheel)
            c.wheel = wheel

    def _tell_of_axle(self, wheel: Wheel) -> None:
        """A joint has one wheel; others that are fixed to its axle are told."""
        path = self.assembly.instances[wheel.instance].path
        for other in self.wheels.on_its_axle(wheel):
            there = self.assembly.instances[other.instance].path
            self.notes.append(
                f"{there} turns on one axle with {path}: a joint has one wheel, so {there} touches no ground; give it a body, a joint and "
                "a wheel of its own, and couple both joints by a [[gear]] with ratio = 1"
            )

    # --- what the joints say about each other

    def _compare(self) -> None:
        degree = Counter(k for c in self.candidates for k in (c.a, c.b))
        total = sum(b.volume for b in self.g.bodies)
        signatures = Counter(self._signature(c) for c in self.candidates)
        base = max(self.g.members, key=lambda k: (self.g.volume(k), -k))  # carries the others, so it is never what spins idly
        for c in self.candidates:
            count = signatures[self._signature(c)]
            if count > 1:
                c.found.append(("repeated", f"the same joint is there {count} times"))
            is_wheel = c.wheel is not None and c.wheel.confidence >= THRESHOLD
            line = Line(point=c.point, axis=c.axis)
            idle = any(k != base and degree[k] == 1 and self._spins_unseen(k, line) for k in (c.a, c.b))
            if c.kind == "hinge" and idle and not is_wheel:
                c.doubts.append(("spins idly", "the part is turned about this axis and carries nothing, so its turning changes nothing"))
            small = min(self.g.extent(c.a), self.g.extent(c.b)) < 2 * SMALL * self.g.size
            if small or min(self.g.volume(c.a), self.g.volume(c.b)) < 1e-3 * total:
                c.doubts.append(("small", "the moving part is small"))
            ends = {k for k, _ in c.found} & {"round end", "round ends"}
            if ends and not is_wheel and 1 in (degree[c.a], degree[c.b]):
                c.doubts.append(("end of the chain", "it carries nothing: it may be a pillar, a foot or a cap"))
            if (
                c.kind == "hinge"
                and not {"nothing else", "stands"} & {k for k, _ in c.found}
                and (is_wheel or {"rotor", "round ends"} & {k for k, _ in c.found})
            ):
                c.found.append(("nothing else", "the two sides meet nowhere else"))

    def _spins_unseen(self, group: int, line: Line) -> bool:
        """Whether a group is round about a line."""
        spin = self.g.group_spin(group)
        return spin is not None and spin.same(line) and self.g.is_round(group)

    def _signature(self, c: Candidate) -> tuple:
        volumes = sorted(round(20 * math.log(max(self.g.volume(k), 1e-12))) for k in (c.a, c.b) if self.g.volume(k) > 0)
        return c.kind, round(c.radius, 5), c.found[0][0], volumes[0]

    # --- the tree

    def _suggestions(self) -> Suggestions:
        order = sorted(self.candidates, key=lambda c: (-c.confidence, c.a, c.b))
        pieces = _Pieces(group=list(self.g.group), sides={c: (c.a, c.b) for c in order}, owner=self._owners())
        self._merge_weak(order)
        self._attach_rest(order)
        owner = self._owners()
        groups = sorted(set(owner.values()), key=lambda k: (-self.g.volume(k), k))
        strong = [c for c in order if c.confidence >= THRESHOLD and self.g.group[c.a] != self.g.group[c.b]]
        root = self._root(groups, strong)
        tree, loops = self._span(strong, root)
        names = self._names_of(groups, owner)
        assumed = {self.g.group[k]: text for k, text in self.assumed.items()}
        bodies = tuple(
            SuggestedBody(name=names[k], instances=tuple(i for i, g in sorted(owner.items()) if g == k), notes=tuple(assumed.get(k, ())))
            for k in self._ordered(groups, root, tree)
        )
        joints, wheels = self._joints(tree, loops, [c for c in order if c not in strong], names, owner, pieces)
        return Suggestions(bodies=bodies, joints=joints, wheels=wheels, root=names[root], notes=tuple(self.notes))

    def _root(self, groups: list[int], strong: list[Candidate]) -> int:
        """The body that carries the others: the largest that is neither a wheel nor a leg, which holds one wheel and hangs on one body.

        groups : from the largest volume down.
        """
        sure = [c.wheel for c in strong if c.wheel is not None and c.wheel.confidence >= THRESHOLD]
        wheels = {self.g.group[wheel.group] for wheel in sure}
        beside: dict[int, set[int]] = defaultdict(set)
        for c in strong:
            a, b = self.g.group[c.a], self.g.group[c.b]
            beside[a].add(b)
            beside[b].add(a)
        rest = [k for k in groups if k not in wheels] or groups
        legs = {k for k in rest if len(beside[k] & wheels) == 1 and len(beside[k] - wheels) == 1}
        return next((k for k in rest if k not in legs), rest[0])

    def _merge_weak(self, order: list[Candidate]) -> None:
        """Join both sides of what is under the threshold, the least sure first, unless they are the two sides of a sure joint."""
        strong = [c for c in order if c.confidence >= THRESHOLD]
        for c in reversed(order):
            a, b = self.g.group[c.a], self.g.group[c.b]
            if c.confidence < THRESHOLD and not any({self.g.group[s.a], self.g.group[s.b]} == {a, b} for s in strong):
                self.g.merge(a, b)

    def _owners(self) -> dict[int, int]:
        """Group of every instance: that of most of its volume; parts without a solid go with the parts drawn beside them."""
        weight: dict[int, dict[int, float]] = defaultdict(lambda: defaultdict(float))
        for i, body in enumerate(self.g.bodies):
            weight[body.instance][self.g.group[i]] += body.volume
        owner = {i: max(sorted(w), key=lambda k: w[k]) for i, w in weight.items()}
        for i, instance in enumerate(self.assembly.instances):
            if i in owner:
                continue
            parts = instance.path.split("/")
            for depth in range(len(parts) - 1, -1, -1):
                beside = "/".join(parts[:depth])
                near = [k for k in weight if not beside or self.assembly.instances[k].path.startswith(beside + "/")]
                if near:
                    place = instance.matrix[:3, 3]
                    owner[i] = owner[min(near, key=lambda k: (float(np.linalg.norm(self.assembly.instances[k].matrix[:3, 3] - place)), k))]
                    break
        return owner

    def _attach_rest(self, order: list[Candidate]) -> None:
        """What touches the machine but hangs on no sure joint moves with what it touches."""
        while True:
            linked: dict[int, set[int]] = defaultdict(set)
            for c in order:
                linked[self.g.group[c.a]].add(self.g.group[c.b])
                linked[self.g.group[c.b]].add(self.g.group[c.a])
            islands = self._connected(linked)
            if len(islands) < 2:
                return
            small = min(islands, key=lambda groups: (sum(self.g.volume(k) for k in groups), min(groups)))
            touching = [(self.g.between(k, n).area, self.g.volume(n), k, n) for k in small for n in self.g.neighbours[k] if n not in small]
            if not touching:
                self._join_nearest(small)
                continue
            *_, own, other = max(touching)
            one, held = (self.joints.path(self.joints.largest(k)) for k in (own, other))
            sentence = f"{one} only touches {held}; it was put with it"
            self.notes.append(sentence)
            self._merge(own, other)
            self.assumed[self.g.group[other]].append(sentence)

    def _span(self, strong: list[Candidate], root: int) -> tuple[list[tuple[Candidate, int, int]], list[Candidate]]:
        """Spanning tree of the surest joints (Kruskal 1956), directed away from the root, and the joints that close loops."""
        parent: dict[int, int] = {}

        def find(k: int) -> int:
            while parent.get(k, k) != k:
                k = parent[k]
            return k

        kept, loops = [], []
        for c in strong:
            a, b = find(self.g.group[c.a]), find(self.g.group[c.b])
            if a == b:
                loops.append(c)
            else:
                parent[b] = a
                kept.append(c)
        directed, reached = [], {root}
        while True:
            step = next((c for c in kept if (self.g.group[c.a] in reached) != (self.g.group[c.b] in reached)), None)
            if step is None:
                rest = [c for c in kept if self.g.group[c.a] not in reached]
                if not rest:
                    return directed, loops
                reached.add(max((self.g.group[rest[0].a], self.g.group[rest[0].b]), key=self.g.volume))
                continue
            a, b = self.g.group[step.a], self.g.group[step.b]
            up, down = (a, b) if a in reached else (b, a)
            directed.append((step, up, down))
            reached.add(down)

    def _ordered(self, groups: list[int], root: int, tree: list[tuple[Candidate, int, int]]) -> list[int]:
        """Root first, then as the tree reaches them."""
        found = [root, *(down for _, _, down in tree)]
        return found + [k for k in groups if k not in found]

    def _joints(
        self,
        tree: list[tuple[Candidate, int, int]],
        loops: list[Candidate],
        weak: list[Candidate],
        names: dict[int, str],
        owner: dict[int, int],
        pieces: "_Pieces",
    ) -> tuple[tuple[SuggestedJoint, ...], tuple[SuggestedWheel, ...]]:
        joints, wheels = [], []
        taken: set[str] = set()

        def unique(name: str, others: Iterable[str] = names.values()) -> str:
            """A name that no joint bears, and no body of the other ones."""
            given, count = name, 1
            while given in taken or given in others:
                count += 1
                given = f"{name}_{count}"
            taken.add(given)
            return given

        for c, up, down in tree:
            moving = tuple(i for i, k in sorted(owner.items()) if k == down)
            joints.append(self._joint(c, unique(names[down], ()), names[up], names[down], moving, False))
            if c.wheel is not None and c.wheel.confidence >= THRESHOLD and self.g.group[c.wheel.group] == down:
                wheels.append(self._wheel_of(c.wheel, joints[-1].name, names[down]))
        for c in loops:
            a, b = names[self.g.group[c.a]], names[self.g.group[c.b]]
            joints.append(self._joint(c, unique(f"{a}_{b}_closure"), a, b, (), True))
        for c in weak:
            a, b = names[self.g.group[c.a]], names[self.g.group[c.b]]
            if a != b:
                joints.append(self._joint(c, unique(f"{a}_{b}_closure"), a, b, (), True))
        carried = [(joint.name, pieces.side(c, up, self.g.group)) for (c, up, _), joint in zip(tree, joints, strict=False)]
        roots = {down: pieces.side(c, down, self.g.group) for c, _, down in tree}
        for body in names:
            inside = [c for c in weak if self.g.group[c.a] == self.g.group[c.b] == body]
            if inside:
                joints += self._unsure(body, inside, roots.get(body), carried, names, owner, pieces, unique)
        return tuple(joints), tuple(wheels)

    def _unsure(
        self,
        body: int,
        weak: list[Candidate],
        root: int | None,
        carried: list[tuple[str, int]],
        names: dict[int, str],
        owner: dict[int, int],
        pieces: "_Pieces",
        unique: Callable[[str], str],
    ) -> list[SuggestedJoint]:
        """Joints under the threshold within one body, each with the bodies that there would be if it and those before it were used.

        root : the piece of the body that the joint above it moves. carried : names of sure joints, and the pieces that carry them.
        """
        mine = {pieces.group[i] for i in self.g.members[body]}
        start = max(mine, key=lambda k: (pieces.volume(k, self.g.bodies), -k)) if root is None else root
        ordered = [(c, *pieces.sides[c]) for c in weak]
        links, closing = outward(start, sorted(mine), ordered, lambda k: pieces.volume(k, self.g.bodies))
        called = {start: names[body]}
        keeps = {names[body]: {i for i, k in owner.items() if k == body}}
        found = []
        for link in links:
            parent = called[link.up]
            moving = {i for i in keeps[parent] if pieces.owner[i] in link.below}
            if not moving or moving == keeps[parent]:  # a solid of an instance that lies in the other side
                called[link.down] = parent
                found.append(self._joint(link.candidate, unique(f"{parent}_joint"), parent, parent, (), False))
                continue
            own = sorted(i for i in moving if pieces.owner[i] == link.down) or sorted(moving)
            child = unique(_slug(self._title(own)) or "body")
            called[link.down] = child
            keeps[parent] -= moving
            keeps[child] = moving
            carries = tuple(name for name, piece in carried if piece in link.below)
            joint = self._joint(link.candidate, child, parent, child, tuple(sorted(moving)), False)
            found.append(replace(joint, staying=tuple(sorted(keeps[parent])), carries=carries))
        for c, a, b in closing:
            one, other = called[a], called[b]
            found.append(self._joint(c, unique(f"{one}_{other}_closure"), one, other, (), one != other))
        return found

    def _joint(self, c: Candidate, name: str, parent: str, child: str, moving: tuple[int, ...], loop: bool) -> SuggestedJoint:
        return SuggestedJoint(
            name=name,
            kind=c.kind,
            parent=parent,
            child=child,
            point=_clean(c.point),
            axis=_clean(positive(c.axis)),
            confidence=round(c.confidence, 2),
            evidence=tuple(text for _, text in c.found),
            doubts=tuple(text for _, text in c.doubts),
            moving=moving,
            loop=loop,
        )

    def _wheel_of(self, w: Wheel, joint: str, body: str) -> SuggestedWheel:
        s = w.symmetry
        return SuggestedWheel(
            name=joint,
            joint=joint,
            body=body,
            instance=w.instance,
            center=_clean(w.center),
            axis=_clean(w.axis),
            radius=s.rim_radius,
            width=s.width,
            grouser_count=s.grouser_count,
            grouser_height=s.grouser_height,
            grouser_thickness=s.grouser_thickness,
            confidence=round(w.confidence, 2),
            evidence=tuple(w.evidence),
        )

    # --- names

    def _names_of(self, groups: list[int], owner: dict[int, int]) -> dict[int, str]:
        taken: Counter = Counter()
        names = {}
        for k in groups:
            members = [i for i, g in sorted(owner.items()) if g == k]
            name = _slug(self._title(members)) or f"body_{len(names) + 1}"
            taken[name] += 1
            names[k] = name if taken[name] == 1 else f"{name}_{taken[name]}"
        return names

    def _title(self, members: list[int]) -> str:
        """The sub-assembly that holds just these instances, else the part of most volume."""
        paths = [self.assembly.instances[i].path for i in members]
        parts = [p.split("/") for p in paths]
        common = []
        for level in zip(*parts, strict=False):
            if len(set(level)) > 1:
                break
            common.append(level[0])
        if len(common) > 1:
            return common[-1]
        volumes = dict.fromkeys(members, 0.0)
        for body in self.g.bodies:
            if body.instance in volumes:
                volumes[body.instance] += body.volume
        largest = max(sorted(members), key=lambda i: volumes[i])
        return paths[members.index(largest)].rsplit("/", 1)[-1]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pieces:
    """The rigid groups before those with an unsure joint between them became one body.

    group : of every solid. sides : the two groups of every candidate. owner : group of every instance.
    """

    group: list[int]
    sides: dict[Candidate, tuple[int, int]]
    owner: dict[int, int]

    def side(self, c: Candidate, body: int, bodies: list[int]) -> int:
        """The side of a candidate that is now in ``body``; ``bodies`` : that of every solid."""
        a, b = self.sides[c]
        return a if bodies[a] == body else b

    def volume(self, piece: int, solids: Sequence[PlacedSolid]) -> float:
        """Of the solids of a piece [m^3]."""
        return sum(solid.volume for solid, k in zip(solids, self.group, strict=True) if k == piece)


def _clean(values: Array) -> Array:
    """Rounded to 1e-9, without negative zeros."""
    return np.round(values, 9) + 0.0


def _slug(name: str) -> str:
    """A name for a sheet: letters, digits, underscores; without the counters that CAD programs append."""
    name = re.sub(r"(:\d+|#\d+)$", "", name.strip())
    name = re.sub(r"\s+v\d+$", "", name)
    name = re.sub(r"\W+", "_", name, flags=re.UNICODE).strip("_")
    return name[:40].rstrip("_") if re.search(r"[^\W_]", name) else ""
