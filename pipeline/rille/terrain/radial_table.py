"""Shapes of a radial landform as a table: straight lines over the distance, between kinks that keep their place; cubics between states."""

import contextlib
import hashlib
import tempfile
import zipfile
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille._terrain import RadialShapes  # pyright: ignore[reportMissingModuleSource]
from rille.terrain import cache
from rille.terrain.landform import Landform, Radial

Array = NDArray[np.float64]

FINE = 1e-7  # error over the largest height at which a table is good enough
FEWEST_CELLS, MOST_CELLS = 1024, 4096
FEWEST_STATES, MOST_STATES = 5, 65
MOST_KNOTS = 8
SCAN = 4096  # intervals in which kinks are looked for
ZOOM = 8  # factor by which the search for a kink narrows, each time
SHARP = 0.002  # share of a second difference that is left after two zooms: of a kink 1/64, of a smooth curve 1/4096
STEEP_KNOTS = (1.0 - 1 / 8, 1.0 - 1 / 64, 1.0 - 1 / 512, 1.0 - 1 / 4096)  # finer and finer towards a border with a slope without bound
NARROW = 1e-6  # width of a cell below which a steep border stands in its place, though its height may be wrong
ASIDE = 1e-12  # distance from a knot at which its limits are read


@dataclass(frozen=True, slots=True, kw_only=True)
class RadialTable:
    """A radial landform's shapes, tabulated.

    Rows stand closer near the state 0, where shapes change fastest (fresh, sharp, just covered); one stands at 0.5.

    error_r : largest error over the largest height, of straight lines in cells of r, measured at their quarters; within 2.5e-4 of a
        border with a slope without bound it is not measured.
    error_state : of cubics between states, measured halfway between them; of 65 states it is that of every second one, which is larger.
    """

    knots: tuple[float, ...]
    counts: NDArray[np.int64]
    cells: Array
    error_r: float
    error_state: float
    shapes: RadialShapes = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Hand the table to the compiled loop."""
        object.__setattr__(self, "shapes", RadialShapes(knots=np.array(self.knots), counts=self.counts, cells=self.cells))

    def position(self, state: Array) -> Array:
        """Index into the rows, with fractions, of states in [0, 1]."""
        state = np.clip(state, 0.0, 1.0)
        t = np.sqrt(state)
        for _ in range(5):  # Newton: the cubic is convex, so that it cannot miss
            t = t - np.where(t > 0, (_spaced(t) - state) / np.maximum(t * (10.0 + 12.0 * t) / 9.0, 1e-300), 0.0)
        place = t * (self.shapes.n_states - 1)
        whole = np.round(place)
        return np.clip(np.where(np.abs(place - whole) < 1e-12 * self.shapes.n_states, whole, place), 0.0, self.shapes.n_states - 1)


def table_of(landform: Landform) -> RadialTable:
    """The table of a radial landform; that of a registered one is kept in the cache, beside evaluated ground.

    Raises
    ------
    InputRefused : if a shape is not finite somewhere. ValueError : if the landform is not radial.
    """
    if landform.radial is None:
        raise ValueError(f"landform '{landform.name}' is not radial")
    return _table(landform.radial, landform.digest)


@lru_cache(maxsize=64)
def _table(radial: Radial, digest: str) -> RadialTable:
    where = cache.writable() if digest else None
    if where is None:
        return tabulate(radial)
    key = hashlib.sha256(f"{cache.version()} {digest}".encode()).hexdigest()[:24]
    path = where / f"table-{key}.npz"
    try:
        with np.load(path) as kept:
            return RadialTable(
                knots=tuple(kept["knots"].tolist()),
                counts=kept["counts"],
                cells=kept["cells"],
                error_r=float(kept["errors"][0]),
                error_state=float(kept["errors"][1]),
            )
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        table = tabulate(radial)
    with contextlib.suppress(OSError), tempfile.NamedTemporaryFile(dir=where, suffix=".part", delete=False) as part:
        np.savez(part, knots=table.knots, counts=table.counts, cells=table.cells, errors=[table.error_r, table.error_state])
        part.close()
        Path(part.name).replace(path)
    return table


def tabulate(radial: Radial) -> RadialTable:
    """The table of a landform's shapes over r / reach in [0, 1) and state in [0, 1]; made once for a landform.

    Cells are equally wide between knots, which lie where shapes have kinks or jumps. Cells and states are doubled until errors are below
    1e-7 of the largest height, or there are 4096 cells and 65 states. Towards a border with a slope without bound (rocks) knots lie closer
    and closer.

    Raises
    ------
    InputRefused : if a shape is not finite somewhere.
    """
    family = _Family(radial)
    some = [0.0] if radial.state is None else [0.0, 0.25, 0.5, 0.75, 1.0]
    knots = _knots(family, some)
    counts = np.maximum(np.ceil(np.diff(knots) * FEWEST_CELLS), FEWEST_CELLS // 8).astype(np.int64)
    while (error_r := max(family.error(knots, counts, state) for state in some)) > FINE and counts.sum() < MOST_CELLS:
        counts = 2 * counts
    start, end = _cells(knots, counts)
    rows, error_state = _states(family, start, end, some)
    return RadialTable(knots=tuple(knots.tolist()), counts=counts, cells=np.stack(rows), error_r=error_r, error_state=error_state)


class _Family:
    """Shapes of a landform over r / reach in [0, 1]."""

    def __init__(self, radial: Radial) -> None:
        self._radial = radial
        r = np.linspace(0.0, 1.0, SCAN + 1)
        self.largest = max(float(np.abs(self(r, state)).max()) for state in (0.0, 0.5, 1.0)) or 1.0

    def __call__(self, r: Array, state: float) -> Array:
        return np.broadcast_to(np.asarray(self._radial.shape(r * self._radial.reach, state), np.float64), r.shape)

    def row(self, start: Array, end: Array, state: float) -> Array:
        """(n, 2): value at the start of each cell and rise over it; at a jump the limits from within."""
        both = self(np.concatenate([start + ASIDE, end - ASIDE]), state)
        return np.stack([both[: len(start)], both[len(start) :] - both[: len(start)]], axis=-1)

    def error(self, knots: Array, counts: NDArray[np.int64], state: float) -> float:
        """Largest error over the largest height at the quarters of the cells."""
        start, end = _cells(knots, counts)
        row = self.row(start, end, state)
        parts = np.array([0.25, 0.5, 0.75])[:, None]
        true = self(start + parts * (end - start), state)
        wide = end - start > NARROW
        return float(np.abs(row[:, 0] + parts * row[:, 1] - true)[:, wide].max()) / self.largest


def _cells(knots: Array, counts: NDArray[np.int64]) -> tuple[Array, Array]:
    """Starts and ends (n,) of the cells between knots."""
    pairs = [np.linspace(low, high, n + 1) for low, high, n in zip(knots[:-1], knots[1:], counts, strict=True)]
    return np.concatenate([edges[:-1] for edges in pairs]), np.concatenate([edges[1:] for edges in pairs])


def _knots(family: _Family, states: list[float]) -> Array:
    """0, where the shapes of these states have kinks (the sharpest, at most 8), and 1."""
    found: dict[float, float] = {}
    for state in states:
        for place, bend in _kinks(family, state):
            twin = next((other for other in found if abs(other - place) < 1e-9), place)
            found[twin] = max(bend, found.get(twin, 0.0))
    sharpest = sorted(found, key=lambda place: -found[place])[:MOST_KNOTS]
    grading = STEEP_KNOTS if any(_steep(family, state) for state in states) else ()
    return np.array([0.0, *sorted({*sharpest, *grading}), 1.0])


def _steep(family: _Family, state: float) -> bool:
    """True if a shape falls to its border ever more steeply, like a root: over the last interval half as much again as over that before."""
    inner, outer, border = family(np.array([1.0 - 2.0 / SCAN, 1.0 - 1.0 / SCAN, 1.0 - ASIDE]), state)
    return bool(abs(outer - border) > 1.5 * abs(inner - outer))


def _kinks(family: _Family, state: float) -> list[tuple[float, float]]:
    """(place, second difference) where a shape has a kink or a jump that would cost more than the error asked for."""
    bends = np.abs(np.diff(family(np.linspace(0.0, 1.0, SCAN + 1), state), 2)) / family.largest
    padded = np.pad(bends, 1)
    peaks = np.flatnonzero((bends > FINE / 4) & (bends >= padded[:-2]) & (bends > padded[2:]))
    kinks = []
    for peak in peaks[np.argsort(-bends[peaks])[: 4 * MOST_KNOTS]]:
        low, high = peak / SCAN, (peak + 2) / SCAN
        sizes = [float(bends[peak])]
        while high - low > 1e-12:
            r = np.linspace(low, high, 2 * ZOOM + 1)
            inner = np.abs(np.diff(family(r, state), 2)) / family.largest
            sharpest = int(inner.argmax())
            sizes.append(float(inner[sharpest]))
            if len(sizes) == 3 and sizes[2] < SHARP * sizes[0]:
                break
            low, high = r[sharpest], r[sharpest + 2]
        else:
            kinks.append(((low + high) / 2, sizes[0]))
    return [(place, bend) for place, bend in kinks if 1e-6 < place < 1.0 - 1e-6]


def _states(family: _Family, start: Array, end: Array, some: list[float]) -> tuple[list[Array], float]:
    """Rows of the table at so many states that cubics between them are good enough; and their largest relative error."""
    if len(some) == 1:
        return [family.row(start, end, 0.0)], 0.0
    t = np.linspace(0.0, 1.0, FEWEST_STATES)
    rows = [family.row(start, end, float(state)) for state in _spaced(t)]
    while True:
        between = [family.row(start, end, float(state)) for state in _spaced((t[:-1] + t[1:]) / 2)]
        error = max(float(np.abs(_halfway(rows, k) - row).max()) for k, row in enumerate(between)) / family.largest
        if error <= FINE:
            return rows, error
        rows = [row for pair in zip(rows, [*between, None], strict=True) for row in pair if row is not None]
        t = np.linspace(0.0, 1.0, len(rows))
        if len(rows) >= MOST_STATES:
            return rows, error


def _spaced(t: Array) -> Array:
    """State of row t (n - 1) of n rows: a cubic, so that shapes which are linear in their state are tabulated exactly; 3/4 maps to 1/2."""
    return t * t * (5.0 + 4.0 * t) / 9.0


def _halfway(rows: list[Array], k: int) -> Array:
    """The cubic through four neighbouring rows halfway between rows k and k + 1, as the compiled loop takes it."""
    first = min(max(k - 1, 0), len(rows) - 4)
    x = k + 0.5 - first
    weights = [float(np.prod([(x - other) / (i - other) for other in range(4) if other != i])) for i in range(4)]
    return np.tensordot(weights, np.stack(rows[first : first + 4]), axes=1)
