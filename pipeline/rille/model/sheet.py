"""Reading TOML sheets: unknown keys, missing keys and wrong types become sentences that name the place."""

import hashlib
import json
import os
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from rille.model.errors import InputRefused, nearest_names
from rille.model.rover import SourceFile


class Sheet(BaseModel):
    """Base of all tables in sheets: unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


S = TypeVar("S", bound=Sheet)


def read_sheet(path: Path, kind: type[S]) -> S:
    """Read a TOML file into a sheet.

    Raises
    ------
    InputRefused : if the file is missing, is not TOML, or does not fit ``kind``; the sentence names the key and its place.
    """
    path = Path(path)
    if not path.is_file():
        raise InputRefused(f"there is no file '{path}'")
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputRefused(f"'{path}' is not valid TOML: {error}") from None
    return validate_sheet(content, kind, str(path))


def validate_sheet(content: Mapping[str, Any], kind: type[S], where: str) -> S:
    """Tables as a sheet; ``where`` names them in sentences.

    Raises
    ------
    InputRefused : if they do not fit ``kind``; the sentence names the key and its place.
    """
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise InputRefused(f"'{where}': {_sentence(first, kind)}") from None


def _sentence(error: Mapping[str, Any], kind: type[Sheet]) -> str:
    loc = [part for part in error["loc"] if part not in ("float", "int", "str")]  # branches of a union
    place = [str(part) if isinstance(part, str) else f"[{part + 1}]" for part in loc]
    where = ".".join(place).replace(".[", "[")
    if error["type"] == "extra_forbidden":
        known = _keys_at(kind, list(error["loc"][:-1]))
        return f"the key '{where}' is unknown; {nearest_names(str(error['loc'][-1]), known)}"
    if error["type"] == "missing":
        return f"the key '{where}' is missing"
    return f"the value of '{where}' is refused: {error['msg'][:1].lower()}{error['msg'][1:]} (it is {error.get('input')!r})"


def _keys_at(kind: type[BaseModel], place: list) -> list[str]:
    """Names of the fields of the table at ``place`` below ``kind``; empty where a place cannot be followed."""
    for part in place:
        if isinstance(part, int):
            continue
        field = kind.model_fields.get(part) or next((f for f in kind.model_fields.values() if f.alias == part), None)
        found = _models_in(field.annotation) if field is not None else []
        if not found:
            return []
        kind = found[0]
    return [field.alias or name for name, field in kind.model_fields.items()]


def _models_in(annotation: object) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for argument in getattr(annotation, "__args__", ()) for m in _models_in(argument)]


def toml_string(text: str) -> str:
    """A basic TOML string: JSON's escapes are TOML's; DEL must be escaped, too."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def data_folder() -> Path:
    """Folder of the real data: ``RILLE_DATA``, else ``shared`` beside the repository."""
    stated = os.environ.get("RILLE_DATA")
    return Path(stated).resolve() if stated else Path(__file__).resolve().parents[4] / "shared"


def expand(text: str, base: Path) -> Path:
    """Path written in a sheet: ``${NAME}`` from the environment, relative to the sheet's folder.

    ``${RILLE_DATA}`` defaults to the folder ``shared`` beside the repository.

    Raises
    ------
    InputRefused : if a variable is not set.
    """

    def value(match: re.Match[str]) -> str:
        name = match.group(1)
        if name in os.environ:
            return str(Path(os.environ[name]).resolve())
        if name == "RILLE_DATA":
            return str(data_folder())
        raise InputRefused(f"the path '{text}' needs the environment variable {name}, which is not set")

    path = Path(re.sub(r"\$\{(\w+)\}", value, text))
    return path if path.is_absolute() else base / path


def source_of(path: Path, subject: str, tool: str) -> SourceFile:
    """Name and SHA-256 digest of a file that values were read from."""
    return SourceFile(subject=subject, file=Path(path).name, sha256=hashlib.sha256(Path(path).read_bytes()).hexdigest(), tool=tool)
