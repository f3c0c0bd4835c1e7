"""A file and its manifest -> recordings, piece by piece: units, origin of time, recorded steps, then the data gate."""

import time as wall
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from rille.model.errors import InputRefused, nearest_names
from rille.model.recording import Array, Channel, Correction, GateFinding, Recording
from rille.model.rover import Vector
from rille.recording.acceptance import Acceptance, acceptance
from rille.recording.columns import Column, Targets, on_clock, plan_columns, scale_steps
from rille.recording.corrections import OF_CHANNEL, WHOLE, Values, correct
from rille.recording.digest import digest_of
from rille.recording.manifest import Manifest
from rille.recording.reading import ROW, Piece, Source, Wanted, open_source
from rille.recording.reading.table import label_text
from rille.recording.spool import Spool
from rille.recording.stamps import Rows, Stamps

CHUNK = 65536  # samples handed on at once
LARGEST = 1e15  # SI: nothing on a machine is larger, so the unit or the scale is wrong, or the number is damaged
COMMIT_EVERY = 1.0  # [s] of real time

Progress = Callable[[str, float], None]
Load = Callable[[str, str, tuple[float, float] | None], Channel]
MANY = 20_000_000  # samples beyond which the gate loads channels one by one


class Gate(Protocol):
    """The data gate. load : reads one channel of a recording, all of it or within a span [s], where they come without samples.

    gravity : [m/s^2] in W; None: not known.
    """

    def __call__(
        self,
        recordings: Sequence[Recording],
        on_progress: Progress | None = None,
        *,
        load: Load | None = None,
        gravity: Vector | None = None,
    ) -> Sequence[Sequence[GateFinding]]:
        """Findings of each recording."""
        ...


class Sink(Protocol):
    """Where the samples of one recording go."""

    def written(self, clock: str) -> int:
        """Samples of a clock that are there already, of an import that was interrupted."""
        ...

    def write(self, clock: str, time: Array, values: Mapping[str, Array]) -> None:
        """Append samples."""
        ...

    def commit(self) -> None:
        """Make them durable."""
        ...

    def finish(self, findings: Sequence[GateFinding], corrections: Sequence[Correction]) -> None:
        """Write what is left and declare the recording complete."""
        ...


class Shelf(Protocol):
    """Where recordings go."""

    def open(self, recording: Recording) -> Sink | None:
        """Begin a recording, or go on with one that was interrupted; None if the same import has completed it before."""
        ...

    def remove(self, name: str) -> None:
        """Forget a recording."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Imported:
    """What an import made. recording : description without samples. samples : of all channels. start, end : [s] first and last time.

    kept : samples that were there from an interrupted import.
    """

    recording: Recording
    samples: int
    start: float
    end: float
    kept: int


@dataclass(slots=True)
class _Building:
    """A recording that is being read."""

    recording: Recording
    columns: tuple[Column, ...]
    steps: tuple[Correction, ...]
    sink: Sink | None
    spool: Spool
    stamps: Stamps
    counted: dict[int, int] = field(default_factory=dict)
    seen: dict[str, int] = field(default_factory=dict)
    kept: dict[str, int] = field(default_factory=dict)
    infinite: dict[str, int] = field(default_factory=dict)

    @property
    def whole(self) -> bool:
        return any(step.kind in WHOLE for step in self.steps)


def import_recording(
    manifest: Manifest,
    shelf: Shelf,
    folder: Path,
    *,
    scenario: str | None = None,
    gravity: Vector | None = None,
    targets: Targets | None = None,
    gate: Gate | None = None,
    on_progress: Progress = lambda what, fraction: None,
    on_refused: Callable[[Sequence[Recording], Load], None] = lambda recordings, load: None,
) -> tuple[Imported, ...]:
    """Read what a manifest names into a shelf; with ``split``, one recording for each distinct set of values.

    Memory is bounded: samples go on in pieces, about once a second they are made durable, and the gate reads long channels from files in
    ``folder``. An import that was interrupted is repeated; what the shelf has already is not written again.

    Parameters
    ----------
    scenario : its name in the database. gravity : [m/s^2] in W, of it; None: not known. targets : names in the model; None: not checked.
    gate : the data gate; None: not asked.
    on_refused : gets the recordings with all findings, and a way to their samples, before an error of the gate refuses them.

    Raises
    ------
    InputRefused : for anything in the manifest or the file that cannot be used, and for an error of the gate that the manifest does not
        accept, with nothing stored.
    """
    sheet = manifest.sheet
    columns = plan_columns(sheet, targets)
    source = open_source(manifest.file, sheet.format)
    columns, wanted = _wanted(manifest, columns, source)
    on_progress("hashing", 0.0)
    head = Recording(
        name=sheet.name,
        kind=sheet.kind,
        scenario=scenario,
        source=manifest.file.name,
        digest=digest_of(manifest.file),
        manifest=manifest.text,
        setup=manifest.setup,
        channels=tuple(column.channel for column in columns),
    )
    _check_steps(manifest, columns)
    reader = _Reader(manifest, columns, head, shelf, folder)
    try:
        reader.read(source, wanted, on_progress)
        built = reader.settle()
        findings: Sequence[Sequence[GateFinding]] = [() for _ in built]
        if gate is not None:
            few = sum(sum(b.seen.values()) * len(columns) for b in built) <= MANY
            examined = [reader.described(b, samples=few) for b in built]
            findings = gate(
                examined, lambda what, part: on_progress(what, 0.7 + 0.25 * part), load=None if few else reader.load, gravity=gravity
            )
            accepted = acceptance(manifest.sheet, columns)
            told = [replace(b.recording, findings=accepted.told(f)) for b, f in zip(built, findings, strict=True)]
            refusal = _refusal(accepted, told)
            if refusal is not None:
                on_refused(told, reader.load)
                raise refusal
            findings = [recording.findings for recording in told]
        imported = []
        for k, (building, found) in enumerate(zip(built, findings, strict=True)):
            on_progress("storing", 0.95 + 0.05 * k / len(built))
            description = replace(reader.described(building, samples=False), findings=tuple(found))
            if building.sink is None:
                continue
            building.sink.finish(description.findings, description.corrections)
            imported.append(reader.summary(building, description))
        return tuple(imported)
    except InputRefused:
        for name in reader.opened:
            shelf.remove(name)
        raise
    finally:
        reader.close()


def _wanted(manifest: Manifest, columns: Sequence[Column], source: Source) -> tuple[tuple[Column, ...], Wanted]:
    sheet = manifest.sheet
    labels = tuple(dict.fromkeys([*sheet.split, *sheet.where]))
    default = sheet.time.column or ROW
    stated = {entry.column: entry.time for entry in sheet.channel if entry.time}
    if source.table and sheet.kind == "time" and not sheet.time.column:
        raise InputRefused(f"'{manifest.path}' says no column of the time; add a table [time] with column = and unit =")
    if not source.table and (sheet.time.column or labels or stated):
        raise InputRefused(
            f"'{manifest.path}' names a column of the time, split or where, but messages are stamped: [time] takes only source and origin"
        )
    source.check([*([sheet.time.column] if sheet.time.column else []), *stated.values(), *(c.column for c in columns), *labels])
    clock_of = {c.column: stated.get(c.column, default) if source.table else source.topic(c.column) for c in columns}
    clocks: dict[str, tuple[str, ...]] = {}
    for column, clock in clock_of.items():
        clocks[clock] = (*clocks.get(clock, ()), column)
    return on_clock(columns, clock_of), Wanted(clocks=clocks, labels=labels, header=sheet.time.source == "header")


def _check_steps(manifest: Manifest, columns: Sequence[Column]) -> None:
    channels = [column.channel.name for column in columns]
    clocks = sorted({column.channel.clock for column in columns})
    for step in manifest.corrections:
        known, what = (channels, "channel") if step.kind in OF_CHANNEL else (clocks, "clock")
        if step.channel and step.channel not in known:
            raise InputRefused(
                f"'{manifest.path}': the correction {step.kind} names the {what} '{step.channel}'; {nearest_names(step.channel, known)}"
            )


def _refusal(accepted: Acceptance, recordings: Sequence[Recording]) -> InputRefused | None:
    """The sentence for errors of the gate that the manifest does not accept; None: there are none."""
    errors = [(recording.name, finding) for recording in recordings for finding in recording.findings if accepted.refuses(finding)]
    if not errors:
        return None
    name, first = errors[0]
    more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
    where = f"channel '{first.channel}' with " if first.channel in accepted.channels else ""
    return InputRefused(
        f"the data gate refuses recording '{name}': {first.message.rstrip('.')}{more}; correct the manifest, "
        f'or accept it there ({where}accepted = ["{first.code}"])'
    )


class _Reader:
    """Sorts the pieces of a source into recordings."""

    def __init__(self, manifest: Manifest, columns: tuple[Column, ...], head: Recording, shelf: Shelf, folder: Path) -> None:
        self.manifest, self.columns, self.head, self.shelf, self.folder = manifest, columns, head, shelf, folder
        self.building: dict[tuple[str, ...], _Building] = {}
        self.opened: list[str] = []
        self.seen_labels: dict[str, set[str]] = {name: set() for name in manifest.sheet.where}
        self.committed = wall.monotonic()

    def read(self, source: Source, wanted: Wanted, on_progress: Progress) -> None:
        """All pieces of the source."""
        for piece in source.pieces(wanted):
            for key, rows in self._groups(piece):
                self._take(key, piece, rows)
            on_progress("reading", 0.7 * piece.done)
            if wall.monotonic() - self.committed > COMMIT_EVERY:
                self.commit()
        if not self.building:
            raise InputRefused(self._nothing())
        if not self.opened:
            names = ", ".join(f"'{building.recording.name}'" for building in list(self.building.values())[:3])
            raise InputRefused(f"the recordings of '{self.manifest.path}' are in the database already ({names}); remove them first")

    def commit(self) -> None:
        """Make durable what is there."""
        for building in self.building.values():
            if building.sink is not None:
                building.sink.commit()
        self.committed = wall.monotonic()

    def settle(self) -> list[_Building]:
        """Do what needs whole recordings, make all durable, and return the recordings in the order of their first samples."""
        for building in self.building.values():
            if building.whole:
                self._correct_whole(building)
            if not any(building.seen.values()):
                raise InputRefused(
                    f"recording '{building.recording.name}' has no samples left after its corrections; check cut and its times"
                )
        self.commit()
        return list(self.building.values())

    def _nothing(self) -> str:
        for name, value in self.manifest.sheet.where.items():
            if label_text(value) not in self.seen_labels[name]:
                known = nearest_names(label_text(value), self.seen_labels[name])
                return f"no row of '{self.manifest.file}' has {name} = {value}; {known}"
        return f"'{self.manifest.file}' has no samples of the channels that '{self.manifest.path}' names"

    def _groups(self, piece: Piece) -> list[tuple[tuple[str, ...], Rows]]:
        """Rows of a piece by the values of the columns that split."""
        keep = np.ones(len(piece.time), dtype=bool)
        for name, value in self.manifest.sheet.where.items():
            labels = piece.labels[name]
            self.seen_labels[name].update(labels.known[code] for code in np.unique(labels.code) if code >= 0)
            codes = [k for k, known in enumerate(labels.known) if known == label_text(value)]
            keep &= np.isin(labels.code, codes)
        split = self.manifest.sheet.split
        if not split:
            return [((), slice(None) if keep.all() else np.flatnonzero(keep))] if keep.any() else []
        code = np.stack([piece.labels[name].code for name in split])[:, keep]
        rows = np.flatnonzero(keep)
        groups, which = np.unique(code, axis=1, return_inverse=True)
        found: list[tuple[int, tuple[str, ...], Rows]] = []
        for k in range(groups.shape[1]):
            chosen = rows[which == k]
            key = tuple((c >= 0 and piece.labels[name].known[c]) or "none" for name, c in zip(split, groups[:, k], strict=True))
            found.append((int(chosen[0]), key, chosen))
        return [(key, chosen) for _, key, chosen in sorted(found, key=lambda group: group[0])]

    def _begin(self, key: tuple[str, ...]) -> _Building:
        recording = replace(self.head, name="/".join([self.head.name, *key]))
        sink = self.shelf.open(recording)
        if sink is not None:
            self.opened.append(recording.name)
        building = _Building(
            recording=recording,
            columns=self.columns,
            steps=self.manifest.corrections,
            sink=sink,
            spool=Spool(self.folder),
            stamps=Stamps.of(self.manifest, recording.name),
        )
        building.kept = {channel.clock: 0 if sink is None else sink.written(channel.clock) for channel in recording.channels}
        self.building[key] = building
        return building

    def _take(self, key: tuple[str, ...], piece: Piece, rows: Rows) -> None:
        building = self.building.get(key) or self._begin(key)
        time = building.stamps.seconds(piece, rows)
        values: Values = {}
        for column in building.columns:
            if column.channel.clock == piece.clock and column.column in piece.values:
                value = piece.values[column.column][rows]
                if column.factor != 1.0 or column.offset != 0.0:
                    with np.errstate(over="ignore"):
                        value = value * column.factor + column.offset
                values[column.channel.name] = self._finite(building, column, value, piece, rows)
        if building.whole:
            building.spool.append(piece.clock, time, values)
            return
        for k, step in enumerate(building.steps):
            time, values, touched = correct(step, piece.clock, time, values, {})
            building.counted[k] = building.counted.get(k, 0) + touched
        building.spool.append(piece.clock, time, values)
        self._write(building, piece.clock, time, values)

    def _finite(self, building: _Building, column: Column, value: Array, piece: Piece, rows: Rows) -> Array:
        """Values with infinite ones as missing, if the manifest accepts missing values."""
        infinite = np.isinf(value)
        if not infinite.any():
            return value
        name = column.channel.name
        if column.missing == "refuse":
            row = piece.number(int(np.arange(len(piece.time))[rows][np.argmax(infinite)])) + 1
            raise InputRefused(
                f"channel '{name}' of recording '{building.recording.name}' is infinite in row {row}; "
                'say missing = "accept" to take such values as missing'
            )
        building.infinite[name] = building.infinite.get(name, 0) + int(infinite.sum())
        return np.where(infinite, np.nan, value)

    def _write(self, building: _Building, clock: str, time: Array, values: Values) -> None:
        """Hand on what the sink does not have yet."""
        seen = building.seen.get(clock, 0)
        for name, value in values.items():
            large = np.abs(value) > LARGEST
            if large.any():
                k, unit = int(np.argmax(large)), building.recording.channel(name).unit
                unit = "" if unit == "1" else f" {unit}"
                raise InputRefused(
                    f"channel '{name}' of recording '{building.recording.name}' is {value[k]:.6g}{unit} in its row {seen + k + 1} "
                    f"(at {time[k]:.6g}{' s' if building.recording.kind == 'time' else ''}), beyond {LARGEST:g}; "
                    "is the unit or scale right? A damaged value is left out by the correction drop_samples"
                )
        building.seen[clock] = seen + len(time)
        skip = min(len(time), max(0, building.kept[clock] - seen))
        if skip < len(time) and building.sink is not None:
            building.sink.write(clock, time[skip:], {name: value[skip:] for name, value in values.items()})

    def _correct_whole(self, building: _Building) -> None:
        """Apply the steps to all samples of a clock at once."""
        raw, building.spool = building.spool, Spool(self.folder)
        for clock in building.kept:
            channels = {channel.name: channel for channel in building.recording.channels if channel.clock == clock}
            time = np.asarray(raw.times(clock))
            values = {name: np.asarray(raw.values(clock, name)) for name in channels}
            for k, step in enumerate(building.steps):
                time, values, touched = correct(step, clock, time, values, channels)
                building.counted[k] = building.counted.get(k, 0) + touched
            for first in range(0, len(time), CHUNK):
                part = slice(first, first + CHUNK)
                self._write(building, clock, time[part], {name: value[part] for name, value in values.items()})
                self.commit()
            building.spool.append(clock, time, values)
        raw.close()

    def described(self, building: _Building, *, samples: bool) -> Recording:
        """The recording with its corrections, with or without samples."""
        steps = [*building.stamps.steps(), *scale_steps(building.columns, self.manifest.sheet)]
        for name, count in building.infinite.items():
            steps.append(Correction(kind="infinite_to_missing", channel=name, detail={"samples": count}, reason='missing = "accept"'))
        for k, step in enumerate(building.steps):
            steps.append(replace(step, detail={**step.detail, "samples": building.counted.get(k, 0)}))
        channels: tuple[Channel, ...] = building.recording.channels
        if samples:
            clocks = {clock: building.spool.times(clock) for clock in building.kept}
            channels = tuple(replace(c, time=clocks[c.clock], value=building.spool.values(c.clock, c.name)) for c in channels)
        return replace(building.recording, corrections=tuple(steps), channels=channels)

    def load(self, recording: str, name: str, span: tuple[float, float] | None) -> Channel:
        """One channel of a recording with its samples, all or those within a span [s]."""
        building = next(b for b in self.building.values() if b.recording.name == recording)
        channel = building.recording.channel(name)
        time, value = building.spool.times(channel.clock), building.spool.values(channel.clock, name)
        if span is None:
            return replace(channel, time=np.array(time), value=np.array(value))
        if building.spool.forward(channel.clock):
            chosen = slice(int(np.searchsorted(time, span[0])), int(np.searchsorted(time, span[1], side="right")))
        else:
            chosen = (time >= span[0]) & (time <= span[1])
        return replace(channel, time=np.array(time[chosen]), value=np.array(value[chosen]))

    def summary(self, building: _Building, description: Recording) -> Imported:
        """Numbers to tell."""
        spans = [building.spool.times(clock) for clock in building.kept]
        spans = [span for span in spans if len(span)]
        return Imported(
            recording=description,
            samples=sum(building.seen.get(channel.clock, 0) for channel in description.channels),
            start=min(float(span.min()) for span in spans),
            end=max(float(span.max()) for span in spans),
            kept=sum(building.kept[channel.clock] for channel in description.channels),
        )

    def close(self) -> None:
        """Forget the samples."""
        for building in self.building.values():
            building.spool.close()
