"""The ways in which rille says no, and the helper that names what was probably meant."""

import difflib
from collections.abc import Iterable


class InputRefused(ValueError):
    """Input that cannot be used: one sentence with the quantity, the value, which one, the bound and the fix.

    The command line prints the sentence and exits with code 3.
    """


class MachineFailed(InputRefused):
    """What was asked is sound, but this machine cannot do it now, most often for want of room on the disk: one sentence with the fix.

    Whoever keeps outcomes must not keep it as one: the same, asked again when there is room, succeeds.
    """


class PhysicsFailed(RuntimeError):
    """A computation that did not converge or left its domain: one sentence with time, place and a hint.

    The command line prints the sentence and exits with code 4.
    """


def nearest_names(wanted: str, known: Iterable[str], count: int = 3) -> str:
    """Say which known names resemble the wanted one, as the end of an error sentence.

    Parameters
    ----------
    wanted : the name that was not found.
    known : the names that exist.
    count : how many to mention at most.

    Returns
    -------
    ``"did you mean 'a', 'b'?"`` or, if nothing resembles it, ``"known: 'a', 'b', ..."``.
    """
    names = sorted(set(known))
    lowered = {name.lower(): name for name in names}
    close = difflib.get_close_matches(wanted.lower(), list(lowered), n=count, cutoff=0.4)
    if close:
        return "did you mean " + ", ".join(f"'{lowered[name]}'" for name in close) + "?"
    if not names:
        return "there are none"
    shown = ", ".join(f"'{name}'" for name in names[: 2 * count])
    return f"known: {shown}" + (", ..." if len(names) > 2 * count else "")
