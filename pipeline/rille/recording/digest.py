"""SHA-256 of a file, or of a folder (ROS 2 bag): of its files' names and contents, in the order of their names."""

import hashlib
from pathlib import Path


def digest_of(path: Path) -> str:
    """Hexadecimal digest."""
    if path.is_file():
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    total = hashlib.sha256()
    for file in sorted(part for part in path.rglob("*") if part.is_file()):
        total.update(f"{file.relative_to(path)}\0{digest_of(file)}\n".encode())
    return total.hexdigest()
