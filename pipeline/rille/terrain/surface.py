"""Evaluated ground: heights in memory or in a file, kept per scene, so that an edit evaluates only what changed.

A scene's heights lie in ``$RILLE_CACHE/terrain`` (else ``~/.cache/rille/terrain``): ``heights.f64`` and ``base.f64``, raw rows, and
``state.json``: what they were made of, and which windows are still to be made. The state is written before heights are touched,
so an evaluation that was interrupted, or killed, goes on where it stopped.
"""

import contextlib
import fcntl
import hashlib
import json
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rille.model import MachineFailed
from rille.terrain import cache
from rille.terrain.composition import Composition
from rille.terrain.grid import Grid, Window
from rille.terrain.placed import Datum

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

TILE = 512  # rows and columns that are evaluated at a time
IN_MEMORY = 25_000_000  # heights; more stay in their file
BASE_KEPT = 40_000_000  # heights; of larger scenes the base is evaluated again where it is needed
RECORDED = 1.0  # [s] after which what is left to be made is written down again, for the case that the process is killed
KEPT_BYTES = 6 * 1024**3  # of all scenes together; what was not used for longest goes first


class HeightFile:
    """Heights (n_rows, n_cols) [m] in a file; an index reads that part of it."""

    def __init__(self, path: Path, shape: tuple[int, int], guard: Any = None) -> None:
        self.path, self.shape, self.ndim, self.dtype = path, shape, 2, np.dtype(np.float64)
        self._guard = guard  # a lock or a temporary folder that must live as long

    def __getitem__(self, key: Any) -> Array:
        """Values of slices or of index arrays, as an array of its own."""
        return np.array(np.memmap(self.path, np.float64, "r", shape=self.shape)[key])

    @property
    def size(self) -> int:
        """Number of heights."""
        return self.shape[0] * self.shape[1]


Surface = Array | HeightFile


@dataclass(slots=True)
class Kept:
    """The folder of one scene's evaluation, locked while it is used. in_use : a surface reads from it on and holds the lock."""

    folder: Path
    lock: Any
    in_use: bool = False
    state: dict[str, Any] = field(default_factory=dict)

    @property
    def datums(self) -> dict[str, Datum]:
        """Datums of the last evaluation by what they depended on."""
        return {key: Datum(**value) for key, value in self.state.get("datums", {}).items()}

    def base(self, composed_of: str, grid: Grid) -> "HeightFile | None":
        """Heights of the base with this digest on this grid, if they are kept."""
        path = self.folder / "base.f64"
        known = self.state.get("based") and self.state.get("base") == composed_of and self.state.get("grid") == _facts(grid)
        return HeightFile(path, grid.shape) if known and _whole(path, grid) else None

    def save(self) -> None:
        """Write the state; it appears complete or not at all."""
        part = self.folder / "state.part"
        part.write_text(json.dumps(self.state))
        part.replace(self.folder / "state.json")


@contextlib.contextmanager
def kept(scene: Path) -> Iterator[Kept]:
    """What is kept of a scene; of a scene that another process evaluates right now, or where nothing can be kept, an empty one."""
    key = hashlib.sha256(str(scene.resolve()).encode()).hexdigest()[:24]
    folder = cache.folder() / key
    temporary = None
    lock: Any = None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / "lock").open("w")
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.utime(folder)  # fails if the folder was tidied away meanwhile
    except (OSError, RuntimeError):
        temporary = tempfile.TemporaryDirectory(prefix="rille-terrain-")
        folder, lock = Path(temporary.name), temporary
    state: dict[str, Any] = {}
    with contextlib.suppress(OSError, ValueError):
        state = json.loads((folder / "state.json").read_text())
    if state.get("version") != cache.version():
        state = {}
    store = Kept(folder=folder, lock=lock, state=state)
    try:
        yield store
    finally:
        if not store.in_use:
            lock.cleanup() if temporary else lock.close()
        store.lock = None  # of a surface in use, the surface holds it
        _tidy(keep=folder)


def height_range(heights: Surface) -> tuple[float, float]:
    """Lowest and highest value [m], missing ones left out, in bounded memory; NaN if all are missing."""
    low, high = np.inf, -np.inf
    rows = max(1, TILE * TILE // heights.shape[1])
    for row in range(0, heights.shape[0], rows):
        band = heights[row : row + rows, :]
        low, high = np.fmin(low, np.fmin.reduce(band, axis=None)), np.fmax(high, np.fmax.reduce(band, axis=None))
    return (float(low), float(high)) if low <= high else (float("nan"), float("nan"))


def evaluate(composition: Composition, store: Kept, datums: dict[str, Datum], progress: Progress | None = None) -> Surface:
    """Heights of a scene on its own grid; only what changed since the last evaluation is made.

    Raises
    ------
    MachineFailed : if the heights cannot be written (a full disk); what was made before is kept.
    """
    grid = composition.grid
    manifest = {
        "version": cache.version(),
        "grid": _facts(grid),
        "base": composition.base.digest,
        "items": [[item.digest, _numbers(item.window(grid))] for item in composition.items],
        "datums": {key: {"z": d.z, "gx": d.gx, "gy": d.gy} for key, d in datums.items()},
    }
    state = store.state
    same = all(state.get(name) == manifest[name] for name in ("version", "grid", "base")) and _whole(store.folder / "heights.f64", grid)
    tiles = grid.tiles(TILE)
    if same:
        changed = _changed(state["items"], manifest["items"])
        todo = [w for w in (Window(**dict(zip(_SIDES, numbers, strict=True))) for numbers in state["todo"] + changed) if not w.empty]
        based = state["based"] and _whole(store.folder / "base.f64", grid)
    else:
        todo, based = [grid.whole], False
    todo = _merged(todo)
    pieces = [tile.meet(window) for tile in tiles for window in todo]
    pieces = [piece for piece in pieces if not piece.empty]
    keep_base = grid.n_rows * grid.n_cols <= BASE_KEPT
    try:
        if not same:  # whatever happens from here on, nothing says that the new, empty files hold the old ground
            (store.folder / "state.json").unlink(missing_ok=True)
        _reserve(store.folder, grid, fresh=not same, base=keep_base)
        store.state = {**manifest, "todo": [_numbers(piece) for piece in pieces], "based": based}
        store.save()
        _make(composition, store, pieces, based, keep_base, progress or (lambda what, fraction: None))
    except OSError as error:
        raise MachineFailed(
            f"the heights of the terrain cannot be written to '{store.folder}': {error}; set RILLE_CACHE to a folder with room"
        ) from error
    path = store.folder / "heights.f64"
    if grid.n_rows * grid.n_cols <= IN_MEMORY:
        return np.fromfile(path, np.float64).reshape(grid.shape)
    store.in_use = True
    return HeightFile(path, grid.shape, store.lock)


def evaluate_aside(composition: Composition, grid: Grid, progress: Progress | None = None) -> Surface:
    """Heights of any grid, in memory or, if they are many, in a temporary file that lives as long as the result."""
    say = progress or (lambda what, fraction: None)
    tiles = grid.tiles(TILE)
    if grid.n_rows * grid.n_cols <= IN_MEMORY:
        heights = np.empty(grid.shape)
        for count, (tile, values, _) in enumerate(_rendered(composition, grid, tiles, None)):
            heights[tile.slices] = values
            say("evaluating", (count + 1) / len(tiles))
        return heights
    try:
        folder = tempfile.TemporaryDirectory(prefix="region-", dir=cache.writable())
        path, lock = Path(folder.name) / "heights.f64", (Path(folder.name) / "mine").open("w")
        fcntl.flock(lock, fcntl.LOCK_EX)
        Path(lock.name).rename(path.with_name("lock"))  # locked from the moment on that others can see it
        with path.open("wb") as file:
            file.truncate(8 * grid.n_rows * grid.n_cols)
            for count, (tile, values, _) in enumerate(_rendered(composition, grid, tiles, None)):
                _write(file.fileno(), grid, tile, values)
                say("evaluating", (count + 1) / len(tiles))
    except OSError as error:
        raise MachineFailed(f"the heights of the region cannot be written: {error}; set RILLE_CACHE to a folder with room") from error
    return HeightFile(path, grid.shape, (folder, lock))


def _make(composition: Composition, store: Kept, pieces: list[Window], based: bool, keep_base: bool, say: Progress) -> None:
    grid = composition.grid
    base_path = store.folder / "base.f64"
    known = HeightFile(base_path, grid.shape) if based and keep_base else None
    left = {_key(piece): piece for piece in pieces}

    def record() -> None:
        store.state["todo"] = [_numbers(piece) for piece in left.values()]
        store.state["based"] = keep_base and (based or not left)
        store.save()

    with contextlib.ExitStack() as files:
        heights = files.enter_context((store.folder / "heights.f64").open("r+b")).fileno()
        bases = files.enter_context(base_path.open("r+b")).fileno() if keep_base and known is None else None
        try:
            recorded = time.monotonic()
            for count, (piece, values, base) in enumerate(_rendered(composition, grid, pieces, known)):
                _write(heights, grid, piece, values)
                if bases is not None:
                    _write(bases, grid, piece, base)
                del left[_key(piece)]
                if time.monotonic() - recorded >= RECORDED:
                    record()
                    recorded = time.monotonic()
                say("evaluating the ground", (count + 1) / len(pieces))
        finally:
            with contextlib.suppress(OSError):
                record()


def _rendered(
    composition: Composition, grid: Grid, pieces: list[Window], known: HeightFile | None
) -> Iterator[tuple[Window, Array, Array]]:
    """(window, heights, base) of all windows, made by as many threads as there are processors."""

    def one(piece: Window) -> tuple[Window, Array, Array]:
        base = composition.base.window(grid, piece) if known is None else known[piece.slices]
        return piece, composition.render(grid, piece, base=base), base

    workers = min(len(os.sched_getaffinity(0)), max(len(pieces), 1))
    if workers == 1:
        yield from map(one, pieces)
        return
    waiting = iter(pieces)
    with ThreadPoolExecutor(workers) as pool:
        running: set[Future[tuple[Window, Array, Array]]] = {pool.submit(one, piece) for piece in islice(waiting, 2 * workers)}
        try:
            while running:
                done, running = wait(running, return_when=FIRST_COMPLETED)
                for future in sorted(done, key=lambda future: future.exception() is not None):  # keep what succeeded
                    yield future.result()
                running |= {pool.submit(one, piece) for piece in islice(waiting, len(done))}
        finally:
            for future in running:
                future.cancel()


def _write(file: int, grid: Grid, window: Window, values: Array) -> None:
    rows = np.ascontiguousarray(values, "<f8")
    for k in range(len(rows)):
        row = memoryview(rows[k]).cast("B")
        place = 8 * ((window.row0 + k) * grid.n_cols + window.col0)
        while row:
            written = os.pwrite(file, row, place)
            row, place = row[written:], place + written


def _reserve(folder: Path, grid: Grid, *, fresh: bool, base: bool) -> None:
    """Make room on the disk before anything is evaluated."""
    size = 8 * grid.n_rows * grid.n_cols
    for name in ("heights.f64", *(["base.f64"] if base else [])):
        path = folder / name
        if fresh:
            path.unlink(missing_ok=True)
        with path.open("ab") as file:
            if file.tell() != size:
                file.truncate(0)
                os.posix_fallocate(file.fileno(), 0, size)


def _whole(path: Path, grid: Grid) -> bool:
    """True if a file has the size of a grid's heights."""
    with contextlib.suppress(OSError):
        return path.stat().st_size == 8 * grid.n_rows * grid.n_cols
    return False


def _changed(before: list[Any], now: list[Any]) -> list[list[int]]:
    """Windows of items that came, went, or changed their place in the order."""
    old, new = [i[0] for i in before], [i[0] for i in now]
    stay_old, stay_new = [d for d in old if d in set(new)], [d for d in new if d in set(old)]
    moved: set[str] = set()
    if stay_old != stay_new:
        first = next((k for k, (a, b) in enumerate(zip(stay_old, stay_new, strict=False)) if a != b), min(len(stay_old), len(stay_new)))
        moved = set(stay_old[first:]) | set(stay_new[first:])
    came, went = set(new) - set(old), set(old) - set(new)
    return [i[1] for i in before if i[0] in went | moved] + [i[1] for i in now if i[0] in came | moved]


def _merged(windows: list[Window]) -> list[Window]:
    """Windows that cover the same values without sharing any: those that overlap become one around both."""
    found: list[Window] = []
    for window in windows:
        while True:
            hit = next((other for other in found if not window.meet(other).empty), None)
            if hit is None:
                break
            found.remove(hit)
            window = Window(
                row0=min(window.row0, hit.row0),
                row1=max(window.row1, hit.row1),
                col0=min(window.col0, hit.col0),
                col1=max(window.col1, hit.col1),
            )
        found.append(window)
    return found


_SIDES = ("row0", "row1", "col0", "col1")


def _numbers(window: Window) -> list[int]:
    return [getattr(window, side) for side in _SIDES]


def _key(window: Window) -> tuple[int, ...]:
    return tuple(_numbers(window))


def _facts(grid: Grid) -> list[float]:
    return [grid.n_rows, grid.n_cols, grid.posting_x, grid.posting_y, grid.x_west, grid.y_north]


def _tidy(keep: Path) -> None:
    """Drop regions of processes that were killed, and, if all together take too much room, the scenes that were not used for longest."""
    with contextlib.suppress(OSError, RuntimeError):
        for folder in cache.folder().glob("region-*"):
            _drop(folder)
        folders = sorted((f for f in cache.folder().iterdir() if (f / "lock").is_file()), key=lambda f: f.stat().st_mtime, reverse=True)
        used = 0
        for folder in folders:
            used += sum(file.stat().st_size for file in folder.iterdir() if file.is_file())
            if used <= KEPT_BYTES or folder == keep:
                continue
            _drop(folder)


def _drop(folder: Path) -> None:
    """Remove a folder, unless it is in use."""
    with contextlib.suppress(OSError), (folder / "lock").open("r+") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(folder)
