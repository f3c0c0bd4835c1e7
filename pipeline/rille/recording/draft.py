"""A draft of a manifest from what a file holds; every guess says why, and what is unknown is ignored until a person fills it in."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rille.model.errors import InputRefused
from rille.model.quantity import to_si
from rille.model.recording import QUANTITIES
from rille.model.sheet import data_folder, toml_string
from rille.recording.columns import Targets
from rille.recording.guess import Guess, guess_column, guess_field, is_time_unit, may_be_time, says_time, split_unit
from rille.recording.names import contradicting, meant, nearest, number_alone, words_of
from rille.recording.reading import Wanted, open_source, timed
from rille.recording.reading.survey import FEW, Facts, Survey, message_fields, survey
from rille.recording.stamps import LARGEST_START

LONGER = 100.0  # a time that ends so much later than the first counts in another unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """text : TOML. guessed, unknown : names of columns that got a meaning, and of those that a person must look at."""

    text: str
    guessed: tuple[str, ...]
    unknown: tuple[str, ...]


def draft_manifest(path: Path, manifest: Path, targets: Targets | None = None) -> Draft:
    """Draft the manifest of a file.

    Parameters
    ----------
    manifest : where the draft will lie; the path of the file is written relative to its folder. targets : names in the model;
        None: unknown.

    Raises
    ------
    InputRefused : if the file cannot be read, or has no column that could be its time.
    """
    found = survey(path)
    name = re.sub(r"[^A-Za-z0-9_.-]+", "_", path.stem) or "recording"
    lines = ["# Draft by `rille record new`: every guess says why. Read it, correct it, then `rille import` it."]
    lines += [
        f"name = {toml_string(name)}",
        f"file = {toml_string(_reference(path, manifest))}",
        f'format = "{found.format}"  # guess: because of its content',
    ]
    writer = _Writer(targets)
    if found.topics:
        lines += [
            "",
            "[time]",
            'source = "log"  # guess: because every message has it; "header" is nearer to the sensor where all messages have one',
        ]
        channels = _topics(found, writer)
    else:
        clock, split, more = _clock(found, path)
        lines += more
        channels = _columns(found, clock, split, writer)
    if not writer.guessed:
        lines.append("# no column could be guessed: give at least one of them a quantity, a target and a unit")
    if left := writer.uncommanded():
        lines.append(f"# no column was guessed to command {', '.join(left)}: what the scenario commands holds there")
    return Draft(text="\n".join(lines + channels) + "\n", guessed=tuple(writer.guessed), unknown=tuple(writer.unknown))


def _reference(path: Path, manifest: Path) -> str:
    """Path of the file as the manifest names it."""
    file, folder = path.resolve(), manifest.resolve().parent
    if file.is_relative_to(folder):
        return file.relative_to(folder).as_posix()
    data = data_folder()
    return f"${{RILLE_DATA}}/{file.relative_to(data).as_posix()}" if file.is_relative_to(data) else file.as_posix()


def _clock(found: Survey, path: Path) -> tuple[Facts, list[str], list[str]]:
    """The column of the time, and the tables that say so."""
    dates = sorted((facts for facts in found.columns if facts.kind == "date"), key=lambda facts: not says_time(facts.name))
    numbers = [facts for facts in found.columns if facts.kind == "number" and may_be_time(facts.name)]
    told = [(facts, _rising_share(facts, path)) for facts in (*dates, *(facts for facts in numbers if says_time(facts.name)))]
    ranked = [facts for least in (1.0, 0.5, 0.0) for facts, share in told if share >= least]
    chosen = next(iter([*ranked, *(facts for facts in numbers if _rises(facts))]), None)
    if chosen is None:
        raise InputRefused(
            f"no column of '{path}' holds dates, is named like a time, or rises from row to row without the name of something else "
            f"({', '.join(f.name for f in found.columns[:6])}); add a column of the time, or write the manifest by hand"
        )
    why = "of its name" if says_time(chosen.name) else "it holds dates" if chosen.kind == "date" else "its values rise from row to row"
    lines, split = [], _split(found, chosen)
    if split:
        names = ", ".join(toml_string(name) for name in split)
        lines.append(
            f"split = [{names}]  # guess: because the time begins anew where {' and '.join(split)} change{'s' if len(split) == 1 else ''}"
        )
    lines += ["", "[time]", f"column = {toml_string(chosen.name)}  # guess: because {why}"]
    if chosen.kind == "date":
        return chosen, split, [*lines, 'origin = "first"  # guess: because it holds dates']
    unit, why = _time_unit(chosen)
    lines.append(f'unit = "{unit}"  # guess: because {why}')
    first = chosen.values[np.isfinite(chosen.values)][:1] * to_si(f"1 {unit}", "time", f"unit of '{chosen.name}'")
    if len(first) and abs(first[0]) > LARGEST_START:
        lines.append(f'origin = "first"  # guess: because it begins at {first[0]:.6g} s, counted from some epoch')
    return chosen, split, lines


def _rising_share(facts: Facts, path: Path) -> float:
    """Share of the first steps of a column by which it rises: 1 of a time, less where it begins anew, 0 of the day of a calibration."""
    times = facts.values
    if facts.kind == "date":
        try:
            piece = next(iter(open_source(path).pieces(Wanted(clocks={facts.name: ()}))), None)
        except InputRefused:  # something among them is no date
            return 0.0
        times = times if piece is None else piece.time
    steps = np.diff(times[timed(times)])
    return float(np.mean(steps > 0)) if len(steps) else 1.0


def _rises(facts: Facts, least: int = 3) -> bool:
    """Whether there are enough numbers, which rise from each filled row to the next; times of fewer rows end in empty cells."""
    values = facts.values[np.isfinite(facts.values)]
    return len(values) >= least and bool(np.all(np.diff(values) > 0))


def _clocks(found: Survey, clock: Facts, split: Sequence[str]) -> list[Facts]:
    """All columns of times, where a table has several clocks; the others rise too, and overlap the first in the same unit."""
    if split or clock.kind != "number" or not _rises(clock):
        return [clock]
    unit, first, last = _time_unit(clock)[0], float(np.nanmin(clock.values)), float(np.nanmax(clock.values))

    def fits(facts: Facts) -> bool:
        if facts.kind != "number" or not says_time(facts.name) or not _rises(facts, least=1):
            return False
        begin, end = float(np.nanmin(facts.values)), float(np.nanmax(facts.values))
        own = split_unit(facts.name)[1]
        return begin <= last and end >= first and end - first < LONGER * (last - first) and (own == unit or not is_time_unit(own))

    return [facts for facts in found.columns if facts is clock or fits(facts)]


def _clock_of(facts: Facts, clocks: Sequence[Facts], found: Survey) -> tuple[Facts, str]:
    """The clock of a column, and why: the one with the fewest rows that has a time wherever the column has a value.

    Of several such, it is the nearest to its left, else to its right.
    """
    names = [column.name for column in found.columns]
    here, filled = names.index(facts.name), np.isfinite(facts.values)
    able = [
        (clock, times)
        for clock in clocks
        if len(clock.values) == len(filled) and not np.any(filled & ~(times := np.isfinite(clock.values)))
    ]
    if not able:
        return clocks[0], "it is the first of the times"
    best = min(able, key=lambda one: (int(one[1].sum()), (here - names.index(one[0].name)) % len(names)))
    same = bool(np.array_equal(best[1], filled))
    return best[0], "the same rows are filled" if same else "it has a time wherever this has a value"


def _time_unit(facts: Facts) -> tuple[str, str]:
    _, unit, ending = split_unit(facts.name)
    if is_time_unit(unit):
        return unit, f"of the ending '{ending}'"
    values = facts.values[np.isfinite(facts.values)]
    if not len(values):
        return "s", "nothing says another"
    size, step = float(np.abs(values).max()), float(np.median(np.abs(np.diff(values)))) if len(values) > 1 else 0.0
    for unit, least in (("ns", 1e17), ("us", 1e14), ("ms", 1e11)):
        if size > least:
            return unit, f"{size:.3g} {unit} since 1970 is a date of our time"
    whole = bool(np.all(values == np.round(values)))
    if whole and 1 <= step <= 1000 and size > 1000 * step / 10:
        return "ms", f"it counts in whole numbers by {step:g}"
    if whole and step > 1000:
        return ("us", f"it counts in whole numbers by {step:g}") if step < 1e6 else ("ns", f"it counts in whole numbers by {step:g}")
    return "s", f"steps of {step:.3g} s are usual"


def _split(found: Survey, clock: Facts) -> list[str]:
    """Columns whose changes go with the time's beginning anew; none if the time always rises."""
    time = clock.values
    anew = np.flatnonzero(np.diff(time) < 0) if len(time) else np.empty(0)
    if not len(anew):
        return [f.name for f in found.columns if f.kind == "text" and 1 < len(f.labels) < FEW][:2] if clock.kind == "number" else []
    chosen = []
    for facts in found.columns:
        values = facts.values
        if facts is clock or facts.kind != "number" or not len(values) or not bool(np.all(values == np.round(values))):
            continue
        changes = np.flatnonzero(np.diff(values) != 0)
        if len(changes) and len(np.unique(values)) <= FEW and set(changes.tolist()) <= set(anew.tolist()):
            chosen.append(facts.name)
    texts = [f.name for f in found.columns if f.kind == "text" and 1 < len(f.labels) < FEW]
    return [*texts, *chosen]


class _Writer:
    """Tables ``[[channel]]`` with their reasons. from_one : whether numbers that stand for names count from 1."""

    def __init__(self, targets: Targets | None) -> None:
        self.targets = targets
        self.guessed: list[str] = []
        self.unknown: list[str] = []
        self.seen: dict[tuple[str, ...], str] = {}
        self.from_one = True

    def count(self, guesses: Iterable[Guess]) -> None:
        """Look whether one of the numbers is 0: then they are those of a quaternion (q0 to q3) as well as of joints."""
        self.from_one = 0 not in [number_alone(" ".join(guess.rest)) for guess in guesses]

    def channel(self, column: str, guess: Guess, note: str = "", time: str = "") -> list[str]:
        """One table. time : its line about the clock, if that is not the first."""
        guess = self._taken_by_its_drive(guess)
        lines = ["", "[[channel]]", f"column = {toml_string(column)}"] + ([time] if time else [])
        target, why_target = self._target(guess) if guess.quantity else ("", "")
        if not guess.quantity or not target:
            self.unknown.append(column)
            reason = guess.because if not guess.quantity else f"{guess.because}, but {why_target}"
            return [*lines, f'role = "ignore"  # unknown: {_comment(reason)}{note}; else give quantity, target, unit and role']
        lines.append(f'quantity = "{guess.quantity}"  # guess: because {_comment(guess.because)}{note}')
        lines += [f'component = "{guess.component}"'] if guess.component else []
        lines.append(f"target = {toml_string(target)}  # guess: because {_comment(why_target)}")
        lines.append(f"unit = {toml_string(guess.unit)}")
        lines += [f'frame = "{guess.frame}"  # guess: because it is told in the axes of the body'] if guess.frame == "body" else []
        key = (guess.quantity, guess.component, target, guess.role, guess.frame)
        role = guess.role
        if key in self.seen and role == "command":
            lines.append(f"role = \"ignore\"  # guess: because '{_comment(self.seen[key])}' commands the same")
        else:
            lines += [f'role = "{role}"'] if role != "observed" else []
            if key in self.seen:
                lines.append(f"redundant = true  # guess: because '{_comment(self.seen[key])}' is the same quantity")
        self.seen.setdefault(key, column)
        self.guessed.append(column)
        return lines

    def uncommanded(self) -> list[str]:
        """Drives of the model that no column commands, as far as was guessed."""
        commanded = {key[2] for key in self.seen if key[3] == "command"}
        return [] if self.targets is None else [drive for drive, joint in self.targets.drives.items() if joint not in commanded]

    def _taken_by_its_drive(self, guess: Guess) -> Guess:
        """A command whose name says no quantity is of the one that its drive takes."""
        if guess.quantity or guess.role != "command" or self.targets is None or not self.targets.drives:
            return guess
        drives = self.targets.drives
        named = {joint: drive for drive, joint in drives.items()} | {drive: drive for drive in drives}
        drive, why = self._find(" ".join(guess.rest), "drive", named)
        if not drive:
            return replace(guess, because=f"{guess.because}, and {why}")
        quantity = self.targets.commands[drive]
        unit = guess.unit or QUANTITIES[quantity].units[self.targets.joints[drives[drive]] == "prismatic"]
        because = f"{guess.because}, and the drive '{drive}' takes {quantity}"
        return replace(guess, quantity=quantity, unit=unit, rest=(drives[drive],), because=because)

    def _target(self, guess: Guess) -> tuple[str, str]:
        """The thing in the model that the rest of the name may mean, and why."""
        kind = QUANTITIES[guess.quantity].target
        if self.targets is None:
            made = "_".join(guess.rest) or kind
            return (f"{kind}_{made}" if made[0].isdigit() else made), "no model was given; it must be a name of the model (--model)"
        joints, drives = self.targets.joints, self.targets.drives
        ordered = {"joint": [name for name in joints if joints[name] != "fixed"], "drive": [*drives]}
        names = ordered[kind] if kind in ordered else sorted(self.targets.named(kind))
        rest = " ".join(guess.rest)
        target, why = self._find(rest, kind, {name: name for name in names})
        number = number_alone(rest)
        if target or number is None or kind not in ordered or not self.from_one or not 1 <= number <= len(names):
            return target, why
        counted = names[number - 1]
        if contradicting(rest, counted) or meant(rest, names):
            return "", why
        return counted, f"it is number {number} of the model's {kind}s"

    def _find(self, rest: str, kind: str, named: Mapping[str, str]) -> tuple[str, str]:
        """The thing in the model that the rest of a column's name means, and why; "" for none or several. named : name -> thing."""
        wheels = () if self.targets is None else self.targets.wheels
        things = list(dict.fromkeys(named.values()))
        if not things:
            return "", f"the model has no {kind}"
        if len(things) == 1 and not any(contradicting(rest, name, name in wheels) for name in named):
            return things[0], f"the model has one {kind}"
        found = list(dict.fromkeys(named[name] for name in meant(rest, named, wheels)))
        if len(found) == 1:
            return found[0], f"'{rest}' fits it and no other {kind}"
        if found:
            return "", f"'{rest}' is ambiguous: it fits {_some(found, ' and ')} equally well"
        which = f"no {kind} of the model fits '{rest}'" if rest else f"its name does not say which {kind} of the model"
        return "", f"{which} ({_some(nearest(rest, things), ', ')})"


def _some(names: Sequence[str], between: str, most: int = 6) -> str:
    """The first of some names, and how many more there are."""
    return between.join(names[:most]) + (f"{between}{len(names) - most} more" if len(names) > most else "")


def _comment(text: str) -> str:
    return re.sub(r"[\x00-\x1f\x7f]", " ", text)


def _columns(found: Survey, clock: Facts, split: Sequence[str], writer: _Writer) -> list[str]:
    lines: list[str] = []
    guesses = [guess_column(facts.name) for facts in found.columns]
    writer.count(guess for guess in guesses if guess.quantity)
    places = {(guess.quantity, guess.component) for guess in guesses}
    falls = ("part.position", "z") in places and not places & {("part.position", "x"), ("part.position", "y")}
    clocks = _clocks(found, clock, split)
    for facts, guess in zip(found.columns, guesses, strict=True):
        if any(facts is one for one in clocks) or facts.kind == "text" or facts.name in split:
            continue
        if facts.kind != "number":
            lines += writer.channel(facts.name, Guess(because=f"it holds {'dates' if facts.kind == 'date' else 'no numbers'}"))
            continue
        values = facts.values[np.isfinite(facts.values)]
        if len(facts.values) and not len(values):
            lines += writer.channel(facts.name, Guess(because="it is empty"))
            continue
        note = f" (first rows: {values.min():.4g} to {values.max():.4g})" if len(values) else ""
        if len(values) and values.min() == values.max():
            note += "; constant there"
        if falls and guess.quantity == "part.linear_velocity" and split_unit(facts.name)[1] and len(words_of(facts.name)) <= 2:
            guess = replace(guess, component="z", because=f"{guess.because}; vertical, as the height is the only coordinate")
        if guess.unit == "rad" and len(values) and np.abs(values).max() > 50 and not split_unit(facts.name)[1] and guess.component:
            note += '; so large an angle may be in "deg"'
        own, why = _clock_of(facts, clocks, found) if len(clocks) > 1 else (clock, "")
        time = "" if own is clock else f"time = {toml_string(own.name)}  # guess: because {why}"
        lines += writer.channel(facts.name, guess, note, time)
    return lines


def _topics(found: Survey, writer: _Writer) -> list[str]:
    lines: list[str] = []
    for topic in found.topics:
        fields: Sequence[tuple[str, float]] = [] if topic.example is None else message_fields(topic)
        guesses = [(field, guess_field(topic.name, topic.kind, field)) for field, _ in fields]
        writer.count(guess for _, guess in guesses)
        known = [(field, guess) for field, guess in guesses if guess.quantity or guess.role == "command"]
        if not known:
            told = ", ".join(field for field, _ in fields[:8]) or "no numbers"
            lines += [
                "",
                f"# topic {_comment(topic.name)} ({_comment(topic.kind)}) was left out, because no field is known: {_comment(told)}",
            ]
            continue
        for field, guess in known:
            lines += writer.channel(f"{topic.name}.{field}", guess)
    return lines
