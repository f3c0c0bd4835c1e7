"""Which names a pattern of a sheet means."""

import fnmatch
from collections.abc import Iterable


def matching(pattern: str, names: Iterable[str]) -> list[str]:
    """The one that is called so, whatever characters its name has; else all that the pattern (``*``, ``?``, ``[abc]``) meets."""
    known = list(names)
    return [pattern] if pattern in known else [name for name in known if fnmatch.fnmatchcase(name, pattern)]
