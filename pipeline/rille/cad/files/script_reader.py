"""CadQuery scripts -> assemblies: a script defines ``build()``, which returns a ``cadquery.Assembly`` or a ``rille.cad.Mechanism``."""

import json
import linecache
import runpy
import sys
import traceback
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from rille.cad.files.assembly import Assembly, Prototype
from rille.cad.files.step_reader import Progress, read_document
from rille.model import InputRefused


def read_script(path: Path, *, progress: Progress | None = None, make: Callable[..., Prototype] = Prototype.of_shape) -> Assembly:
    """Run a script in this process and read what its ``build()`` returns; ``progress`` and ``make`` as in :func:`read_step`.

    Raises
    ------
    InputRefused : for an error in the script, with its line; for a script without ``build()``, or one that returns
        something else; and as :func:`rille.cad.read_document`.
    """
    result = _result(path)
    tables = getattr(result, "tables", {})
    assembly = _assembly(getattr(result, "assembly", result), path)
    try:
        tables = json.loads(json.dumps(tables, allow_nan=False))
    except (TypeError, ValueError) as error:
        raise InputRefused(f"script '{path}' declares a table that is no plain data ({error}); use numbers, texts, lists") from error
    read = read_document(_document(assembly, path), path, progress=progress, make=make)
    return replace(read, tables=tables)


def _result(path: Path) -> Any:
    script = str(path.resolve())
    sys.path.insert(0, str(path.resolve().parent))
    sys.argv = [script]
    try:
        build = runpy.run_path(script, run_name="rille_script").get("build")
        if not callable(build):
            raise InputRefused(f"script '{path}' defines no function build(); let it return a cadquery.Assembly or a rille.cad.Mechanism")
        return build()
    except InputRefused:
        raise
    except (Exception, SystemExit) as error:
        line = _line(error, script)
        where = f" line {line}: {linecache.getline(script, line).strip()!r}" if line else ""
        said = f": {error}".rstrip(": ").replace("\n", " ")
        raise InputRefused(
            f"script '{path}' failed with {type(error).__name__}{said}{where and ' at'}{where}; correct the script"
        ) from error


def _line(error: BaseException, script: str) -> int:
    """The innermost line of the script itself that the error came through; 0 if there is none."""
    if isinstance(error, SyntaxError) and error.filename == script:
        return error.lineno or 0
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == script]
    return (lines[-1] or 0) if lines else 0


def _assembly(value: Any, path: Path) -> Any:
    import cadquery

    if isinstance(value, cadquery.Assembly):
        return value
    if isinstance(value, cadquery.Workplane | cadquery.Shape):
        return cadquery.Assembly(value, name=path.stem)
    raise InputRefused(
        f"build() of script '{path}' returns {type(value).__name__}; it must be a cadquery.Assembly or a rille.cad.Mechanism"
    )


def _document(assembly: Any, path: Path) -> Any:
    """The XCAF document of a CadQuery assembly; paths are those of its STEP export."""
    from cadquery.occ_impl.assembly import toCAF

    try:
        _, document = toCAF(assembly)
    except ValueError as error:
        raise InputRefused(f"build() of script '{path}' returns an assembly without any shape ({error}); add a part") from error
    return document
