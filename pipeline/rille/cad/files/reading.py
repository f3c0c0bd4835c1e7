"""The door for CAD files: STEP or a CadQuery script, read in a child process, kept in the cache.

What is in the cache already comes back without importing OCCT. :func:`rille.cad.read_step` reads in this process.
"""

import contextlib
import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rille.cad.files import cache, child, saved
from rille.cad.files.assembly import Assembly, Prototype
from rille.cad.files.step_text import check_step_file, external_files, what_is_wrong
from rille.cad.geometry import brep_bytes
from rille.model import InputRefused, Mesh

Progress = Callable[[str, float], None]


def load_assembly(path: Path, *, progress: Progress | None = None, note: Callable[[str], None] | None = None) -> Assembly:
    """Read an assembly from a STEP file, or from a script (``*.py``) whose ``build()`` returns one.

    Parameters
    ----------
    path : the file; external references of STEP are sought beside it.
    progress : called with what is being done and the fraction done.
    note : called with a sentence about whatever was left out (also in ``Assembly.notes``).

    Returns
    -------
    The assembly; its shapes are fetched when they are asked for.

    Raises
    ------
    InputRefused : as :func:`rille.cad.read_step`, for a file that makes OCCT crash or takes too long
        (``$RILLE_PATIENCE`` multiplies the time), and for an error in a script, with its line.
    """
    path = Path(path)
    assembly = _script(path, progress) if path.suffix.lower() == ".py" else _step(path, progress)
    for sentence in assembly.notes:
        if note is not None:
            note(sentence)
    return assembly


def load_assemblies(
    paths: Sequence[Path], *, progress: Progress | None = None, note: Callable[[str], None] | None = None
) -> list[Assembly]:
    """Read several files as :func:`load_assembly` does; the STEP files that are new share one child process."""
    fresh = []
    for path in dict.fromkeys(map(Path, paths)):
        if path.suffix.lower() != ".py":
            check_step_file(path)
            key = _key(path)
            if not cache.has(key):
                fresh.append({"path": str(path), "bytes": _bytes(path), "key": key})
    if len(fresh) > 1:
        # Whatever goes wrong here happens once more below, to the one file that it belongs to.
        with contextlib.suppress(child.ChildDied, InputRefused):
            child.run({"do": "read all", "files": fresh, "subject": "one of the files"}, progress=progress)
    return [load_assembly(path, progress=progress, note=note) for path in paths]


def _step(path: Path, progress: Progress | None) -> Assembly:
    check_step_file(path)

    def read(say: Progress | None = None) -> dict[str, Any]:
        job = {"do": "read", "path": str(path), "bytes": _bytes(path), "face_names": True, "subject": f"'{path}'"}
        try:
            return child.run(job, progress=say)
        except child.ChildDied as death:
            if not death.crashed:
                raise _broken(path, death) from death
        try:
            values = child.run({**job, "face_names": False}, progress=say)
        except child.ChildDied as death:
            raise _broken(path, death) from death
        values["notes"] = [*values["notes"], f"names of faces in '{path.name}' were left out, since reading them crashes OCCT"]
        return values

    key = _key(path)
    values = saved.structure(key)
    if values is None:
        values = read(progress)
        saved.keep_structure(key, values)
        cache.prune()
    return saved.restored(values, path, lambda digest: _shape(digest, read))


def _bytes(path: Path) -> int:
    """Bytes of a file and its external references."""
    return sum(file.stat().st_size for file in (path, *(file for _, file in external_files(path) if file is not None)))


def _broken(path: Path, death: child.ChildDied) -> InputRefused:
    wrong = what_is_wrong(path)
    why = f" ({wrong})" if wrong else ""
    return InputRefused(
        f"'{path}' {death.how} while {death.stage}{why}; the file is broken or too complex: check it in CAD and export it again"
    )


def _key(path: Path) -> str:
    """Name (it names what has no name), content, and the external references with their content."""
    parts = [f"assembly {path.stem}", hashlib.sha256(path.read_bytes()).hexdigest()]
    for name, file in external_files(path):
        parts.append(f"{name} {'missing' if file is None else hashlib.sha256(file.read_bytes()).hexdigest()}")
    return "\n".join(parts)


def _script(path: Path, progress: Progress | None) -> Assembly:
    if not path.is_file():
        raise InputRefused(f"there is no script '{path}'")

    def read(say: Progress | None = None) -> dict[str, Any]:
        try:
            return child.run({"do": "script", "path": str(path), "subject": f"script '{path}'"}, progress=say, talk=True)
        except child.ChildDied as death:
            raise InputRefused(f"script '{path}' {death.how} while {death.stage}; simplify what it builds") from death

    return saved.restored(read(progress), path, lambda digest: _shape(digest, read))


def _shape(digest: str, read: Callable[[], dict[str, Any]]) -> Any:
    """A shape from the cache, or once more from its file."""
    shape = saved.saved_shape(digest)
    if shape is None:
        read()
        shape = saved.saved_shape(digest)
    if shape is None:
        raise InputRefused(f"the file of a part changed while it was in use (its B-rep {digest[:12]} is gone); start again")
    return shape


def mesh_of(prototype: Prototype, tolerance: float) -> Mesh | None:
    """Triangles of one part, see :func:`meshes_of`."""
    return meshes_of([prototype], tolerance)[0]


def meshes_of(prototypes: Sequence[Prototype], tolerance: float, *, progress: Progress | None = None) -> list[Mesh | None]:
    """Triangles within ``tolerance`` [m] of parts; None for a part without a face.

    What the cache does not hold for (B-rep, tolerance, version) is made by one child process.

    Raises
    ------
    InputRefused : for a part that makes OCCT crash, or takes too long to tessellate.
    """
    found = {p.digest: saved.saved_mesh(p.digest, tolerance) for p in prototypes}
    missing = {p.digest: p for p in prototypes if found[p.digest] is None}
    if missing:
        _mesh(list(missing.values()), tolerance, progress)
        found.update({digest: saved.saved_mesh(digest, tolerance) for digest in missing})
    meshes = []
    for prototype in prototypes:
        mesh = found[prototype.digest]
        if mesh is None:
            raise InputRefused(f"the triangles of part '{prototype.name}' vanished from the cache '{cache.folder()}'; start again")
        meshes.append(mesh[0])
    return meshes


def _mesh(prototypes: list[Prototype], tolerance: float, progress: Progress | None) -> None:
    for prototype in prototypes:
        if not saved.has_shape(prototype.digest):
            saved.keep_brep(prototype.digest, brep_bytes(prototype.shape))
    parts = [{"name": p.name, "digest": p.digest, "bytes": saved.brep_size(p.digest)} for p in prototypes]
    names = ", ".join(f"'{p.name}'" for p in prototypes[:3])
    subject = f"part {names}" if len(prototypes) == 1 else f"one of the parts {names}"
    try:
        child.run({"do": "mesh", "parts": parts, "tolerance": tolerance, "subject": subject}, progress=progress)
    except child.ChildDied as death:
        part = death.stage.removeprefix("meshing ")
        raise InputRefused(
            f"part '{part}' {death.how} while its triangles were made at a tolerance of {1e3 * tolerance:g} mm; "
            "check its geometry in CAD, or take a coarser tolerance"
        ) from death
