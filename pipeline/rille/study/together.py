"""What the entries of a study may not do together: set one number twice, add an effect twice, or an effect without amplitude."""

from collections.abc import Sequence
from dataclasses import replace

from rille.model import EffectKind, InputRefused
from rille.model.study import Change

Entry = tuple[str, Sequence[Change], bool]  # name, what it changes, whether it is ever another number than 0

GRAVITY = Change(kind="parameter", name="gravity.z")  # what scenario.gravity sets


def require_together(entries: Sequence[Entry], effects: Sequence[EffectKind]) -> None:
    """Check the entries of a study, constants among them, against each other.

    Raises
    ------
    InputRefused : for two that set the same number or add the same effect, and for one that could change nothing.
    """
    _require_once(entries)
    added: dict[str, dict[str, list[Entry]]] = {}  # by law and target
    for entry in entries:
        for change in entry[1]:
            if change.kind == "effect":
                added.setdefault(change.name, {}).setdefault(change.target, []).append(entry)
    for law, targets in added.items():
        if "*" in targets and len(targets) > 1:
            first, second = (targets[target][0][0] for target in list(targets)[:2])
            raise InputRefused(f"'{first}' and '{second}' would add two {law} to the same target; name * or each target, not both")
        amplitudes = [p.name for kind in effects if kind.name == law for p in kind.parameters if p.amplitude]
        for target, found in targets.items():
            _require_amplitude(law, target, found, amplitudes)


def _require_once(entries: Sequence[Entry]) -> None:
    owner: dict[Change, str] = {}
    for name, changes, _ in entries:
        for change in changes:
            number = GRAVITY if (change.kind, change.name) == ("scenario", "gravity") else replace(change, relative=False)
            other = owner.setdefault(number, name)
            if other != name:
                what = f"both set {number.name}" if number.kind == "parameter" else "set the same number"
                raise InputRefused(f"'{other}' and '{name}' {what}; keep one of them, or narrow its pattern")


def _require_amplitude(law: str, target: str, found: Sequence[Entry], amplitudes: Sequence[str]) -> None:
    """One of the amplitudes, which are 0 unless given, must be something."""
    acting = any(change.number in amplitudes for _, changes, acts in found if acts for change in changes)
    if not acting:
        wanted = " or ".join(f"effect.{law}.{target}.{amplitude}" for amplitude in amplitudes)
        raise InputRefused(f"'{found[0][0]}' changes nothing while the effect has no amplitude; vary or set {wanted}, too")
