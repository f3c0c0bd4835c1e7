"""How long the work of a child process may take."""

import os


def read_limit(n_bytes: int) -> float:
    """Processor seconds for reading and weighing a file: sound files take less than 1 s below 0.1 MB, then at most 8 s a megabyte."""
    return patience() * (4.0 + 30.0 * max(n_bytes / 1e6 - 0.1, 0.0))


def mesh_limit(n_bytes: int) -> float:
    """Processor seconds for the triangles of a part whose B-rep has that many bytes: sound parts take well under 1 s."""
    return patience() * (5.0 + 30.0 * n_bytes / 1e6)


def patience() -> float:
    """``$RILLE_PATIENCE`` multiplies every limit of time."""
    try:
        return max(float(os.environ.get("RILLE_PATIENCE", "1")), 0.01)
    except ValueError:
        return 1.0
