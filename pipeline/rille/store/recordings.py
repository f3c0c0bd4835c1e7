"""Recordings <-> tables recording, clock, channel and their blocks of samples."""

import json
import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rille.model import InputRefused, nearest_names
from rille.model.recording import Channel, Correction, GateFinding, Recording
from rille.store.database import insert, reading, writing

Array = NDArray[np.float64]
BLOCK = 4096  # samples
DESCRIPTION = ("name", "quantity", "component", "target", "unit", "role", "frame", "noise", "slow_noise", "delay", "resolution")


class RecordingWriter:
    """Writes one recording in pieces, in bounded memory.

    Every ``commit`` makes what was written so far durable, under status ``importing``; ``finish`` makes the recording complete. A writer
    that is opened for a recording that was interrupted goes on: ``written(clock)`` tells how many samples it already holds (whole blocks).
    """

    def __init__(self, path: Path, recording: Recording) -> None:
        """Open the recording for writing: that which was interrupted, if name and digest are the same, else a new one.

        Raises
        ------
        InputRefused : if a complete recording of that name exists, or its scenario does not.
        """
        self._path = Path(path)
        with writing(self._path) as connection:
            old = connection.execute("SELECT id, status, digest, manifest FROM recording WHERE name = ?", (recording.name,)).fetchone()
            if old is not None and old["status"] == "complete":
                raise InputRefused(
                    f"'{path}' holds a recording '{recording.name}' already; give the manifest another name, or remove that one first: "
                    f"`rille record remove {path} {recording.name}`"
                )
            if old is not None and (old["digest"], old["manifest"]) != (recording.digest, recording.manifest):
                connection.execute("DELETE FROM recording WHERE id = ?", (old["id"],))
                old = None
            self._id = old["id"] if old is not None else _insert_head(connection, recording)
            rows = connection.execute("SELECT id, name, clock_id FROM channel WHERE recording_id = ?", (self._id,)).fetchall()
            self._channels = {row["name"]: (row["id"], row["clock_id"]) for row in rows}
            clocks = connection.execute("SELECT id, name FROM clock WHERE recording_id = ?", (self._id,)).fetchall()
            self._clocks = {row["name"]: row["id"] for row in clocks}
            query = "SELECT coalesce(sum(n), 0) FROM clock_block WHERE clock_id = ?"
            self._written = {name: int(connection.execute(query, (key,)).fetchone()[0]) for name, key in self._clocks.items()}
        self._pending: dict[str, tuple[list[Array], dict[str, list[Array]]]] = {name: ([], {}) for name in self._clocks}
        self._ready: list[tuple[str, tuple]] = []

    def written(self, clock: str) -> int:
        """Samples of a clock that are durable or ready; only whole blocks count."""
        return self._written[clock]

    def write(self, clock: str, time: Array, values: Mapping[str, Array]) -> None:
        """Append samples of one clock: time (n,) [s], and (n,) values [SI] of every channel that it stamps."""
        times, columns = self._pending[clock]
        times.append(np.asarray(time, dtype="<f8"))
        for name, value in values.items():
            columns.setdefault(name, []).append(np.asarray(value, dtype="<f8"))
        if sum(len(piece) for piece in times) >= BLOCK:
            self._cut(clock, last=False)

    def _cut(self, clock: str, *, last: bool) -> None:
        times, columns = self._pending[clock]
        time = np.concatenate(times) if times else np.empty(0)
        whole = {name: np.concatenate(pieces) for name, pieces in columns.items()}
        done = 0
        while len(time) - done >= BLOCK or (last and done < len(time)):
            n = min(BLOCK, len(time) - done)
            piece, block = time[done : done + n], self._written[clock] // BLOCK
            finite = piece[np.isfinite(piece)]
            first, end = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
            row = (self._clocks[clock], block, n, first, end, piece.astype("<f8").tobytes())
            self._ready.append(("INSERT INTO clock_block VALUES (?, ?, ?, ?, ?, ?)", row))
            for name, value in whole.items():
                part = value[done : done + n].astype("<f8").tobytes()
                self._ready.append(("INSERT INTO sample_block VALUES (?, ?, ?, ?)", (self._channels[name][0], block, n, part)))
            self._written[clock] += n
            done += n
        self._pending[clock] = ([time[done:]], {name: [value[done:]] for name, value in whole.items()})

    def commit(self) -> None:
        """Make whole blocks durable."""
        if not self._ready:
            return
        with writing(self._path, known_sound=True) as connection:
            for statement, row in self._ready:
                connection.execute(statement, row)
        self._ready.clear()

    def finish(self, findings: Iterable[GateFinding] = (), corrections: Iterable[Correction] = ()) -> None:
        """Write what is left and make the recording complete."""
        for clock in self._clocks:
            self._cut(clock, last=True)
        self.commit()
        with writing(self._path, known_sound=True) as connection:
            _write_notes(connection, self._id, findings, corrections)
            connection.execute("UPDATE recording SET status = 'complete' WHERE id = ?", (self._id,))


def _insert_head(connection: sqlite3.Connection, recording: Recording) -> int:
    scenario_id = None
    if recording.scenario is not None:
        names = {row["name"]: row["id"] for row in connection.execute("SELECT id, name FROM scenario")}
        if recording.scenario not in names:
            raise InputRefused(
                f"recording '{recording.name}' names the scenario '{recording.scenario}', which the database does not hold; "
                f"{nearest_names(recording.scenario, names)}"
            )
        scenario_id = names[recording.scenario]
    subject = f"recording '{recording.name}'"
    row = {
        "name": recording.name,
        "kind": recording.kind,
        "scenario_id": scenario_id,
        "source": recording.source,
        "digest": recording.digest,
    }
    row |= {"manifest": recording.manifest, "setup": json.dumps(recording.setup), "status": "importing"}
    key = insert(connection, "recording", subject, row)
    clocks = {}
    for channel in recording.channels:
        if channel.clock not in clocks:
            clocks[channel.clock] = insert(connection, "clock", subject, {"recording_id": key, "name": channel.clock})
        row = {column: getattr(channel, column) for column in DESCRIPTION}
        row |= {"recording_id": key, "clock_id": clocks[channel.clock]}
        insert(connection, "channel", f"channel '{channel.name}' of {subject}", row)
    return key


def _write_notes(
    connection: sqlite3.Connection, recording_id: int, findings: Iterable[GateFinding], corrections: Iterable[Correction]
) -> None:
    for table in ("gate_finding", "correction"):
        connection.execute(f"DELETE FROM {table} WHERE recording_id = ?", (recording_id,))
    for step, correction in enumerate(corrections, start=1):
        row = {"recording_id": recording_id, "step": step, "kind": correction.kind, "channel": correction.channel}
        row |= {"detail": json.dumps(dict(correction.detail)), "reason": correction.reason}
        insert(connection, "correction", f"correction {step}", row)
    for finding in findings:
        row = {"recording_id": recording_id, "code": finding.code, "severity": finding.severity, "channel": finding.channel}
        row |= {"detail": json.dumps(dict(finding.detail)), "message": finding.message}
        insert(connection, "gate_finding", f"finding '{finding.code}'", row)


def write_recording(path: Path, recording: Recording) -> None:
    """Store a recording that is in memory.

    Raises
    ------
    InputRefused : if a recording of that name exists, or its scenario does not.
    """
    writer = RecordingWriter(path, recording)
    clocks: dict[str, list[Channel]] = {}
    for channel in recording.channels:
        clocks.setdefault(channel.clock, []).append(channel)
    for clock, channels in clocks.items():
        writer.write(clock, channels[0].time, {channel.name: channel.value for channel in channels})
    writer.finish(recording.findings, recording.corrections)


def write_findings(path: Path, name: str, findings: Iterable[GateFinding]) -> None:
    """Replace what the data gate found in a recording.

    Raises
    ------
    InputRefused : if there is no recording of that name.
    """
    with writing(path) as connection:
        key = _key(connection, name, path)
        rows = connection.execute("SELECT * FROM correction WHERE recording_id = ? ORDER BY step", (key,)).fetchall()
        _write_notes(connection, key, findings, [_correction(row) for row in rows])


def remove_recording(path: Path, name: str) -> None:
    """Delete a recording with its samples, findings and corrections.

    Raises
    ------
    InputRefused : if there is no recording of that name.
    """
    with writing(path) as connection:
        connection.execute("DELETE FROM recording WHERE id = ?", (_key(connection, name, path),))


def recording_names(path: Path, *, unfinished: bool = False) -> tuple[str, ...]:
    """Names of the complete recordings, in the order of import; with ``unfinished`` also of those whose import was interrupted."""
    with reading(path) as connection:
        query = "SELECT name FROM recording WHERE status = 'complete' OR ? ORDER BY id"
        return tuple(row["name"] for row in connection.execute(query, (unfinished,)))


def recording_clocks(path: Path, name: str) -> dict[str, tuple[int, float, float]]:
    """Of every clock of a recording: number of samples, first and last time [s].

    Raises
    ------
    InputRefused : if there is no recording of that name.
    """
    with reading(path) as connection:
        query = (
            "SELECT clock.name AS name, sum(n) AS n, min(first) AS first, max(last) AS last "
            "FROM clock JOIN clock_block ON clock_id = clock.id WHERE recording_id = ? GROUP BY clock.id ORDER BY clock.id"
        )
        rows = connection.execute(query, (_key(connection, name, path),)).fetchall()
        return {row["name"]: (row["n"], row["first"], row["last"]) for row in rows}


def _key(connection: sqlite3.Connection, name: str, path: Path) -> int:
    names = {row["name"]: row["id"] for row in connection.execute("SELECT id, name FROM recording")}
    if name not in names:
        raise InputRefused(f"'{path}' has no recording '{name}'; {nearest_names(name, names)}")
    return names[name]


def _correction(row: sqlite3.Row) -> Correction:
    return Correction(kind=row["kind"], channel=row["channel"], detail=json.loads(row["detail"]), reason=row["reason"])


def read_recording(
    path: Path, name: str, *, channels: Sequence[str] | None = None, span: tuple[float, float] | None = None, samples: bool = True
) -> Recording:
    """A recording with its samples.

    Parameters
    ----------
    channels : names of those whose samples are wanted; None: all. The others come without samples.
    span : only blocks that touch these times [s] are read, and only samples within them are returned.
    samples : False: descriptions, findings and corrections only.

    Raises
    ------
    InputRefused : if there is no complete recording of that name.
    """
    with reading(path) as connection:
        key = _key(connection, name, path)
        query = (
            "SELECT recording.*, scenario.name AS scenario FROM recording LEFT JOIN scenario ON scenario.id = scenario_id "
            "WHERE recording.id = ?"
        )
        head = connection.execute(query, (key,)).fetchone()
        if head["status"] != "complete":
            raise InputRefused(f"the import of recording '{name}' was interrupted; run `rille import` again to go on with it")
        rows = connection.execute(
            "SELECT channel.*, clock.name AS clock FROM channel JOIN clock ON clock.id = clock_id "
            "WHERE channel.recording_id = ? ORDER BY channel.id",
            (key,),
        ).fetchall()
        times: dict[int, tuple[Array, NDArray[np.bool_] | None, list[int]]] = {}
        read = []
        for row in rows:
            columns = (
                "name",
                "quantity",
                "component",
                "target",
                "unit",
                "role",
                "frame",
                "noise",
                "slow_noise",
                "delay",
                "resolution",
                "clock",
            )
            channel = Channel(**{column: row[column] for column in columns})
            if samples and (channels is None or channel.name in channels):
                if row["clock_id"] not in times:
                    times[row["clock_id"]] = _times(connection, row["clock_id"], span)
                time, chosen, blocks = times[row["clock_id"]]
                value = _values(connection, row["id"], blocks)
                channel = replace(channel, time=time, value=value if chosen is None else value[chosen])
            read.append(channel)
        corrections = connection.execute("SELECT * FROM correction WHERE recording_id = ? ORDER BY step", (key,)).fetchall()
        findings = connection.execute("SELECT * FROM gate_finding WHERE recording_id = ? ORDER BY id", (key,)).fetchall()
        return Recording(
            name=head["name"],
            kind=head["kind"],
            scenario=head["scenario"],
            source=head["source"],
            digest=head["digest"],
            manifest=head["manifest"],
            setup=json.loads(head["setup"]),
            channels=tuple(read),
            corrections=tuple(_correction(row) for row in corrections),
            findings=tuple(
                GateFinding(
                    code=row["code"],
                    severity=row["severity"],
                    channel=row["channel"],
                    detail=json.loads(row["detail"]),
                    message=row["message"],
                )
                for row in findings
            ),
        )


def read_channel(path: Path, recording: str, channel: str, span: tuple[float, float] | None = None) -> Channel:
    """One channel of a recording with its samples, or those within ``span`` [s]. Raises as ``read_recording``."""
    return read_recording(path, recording, channels=[channel], span=span).channel(channel)


def _times(
    connection: sqlite3.Connection, clock_id: int, span: tuple[float, float] | None
) -> tuple[Array, NDArray[np.bool_] | None, list[int]]:
    where, bounds = ("", ()) if span is None else (" AND last >= ? AND first <= ?", span)
    query = f"SELECT block, data FROM clock_block WHERE clock_id = ?{where} ORDER BY block"
    rows = connection.execute(query, (clock_id, *bounds)).fetchall()
    time = np.frombuffer(b"".join(row["data"] for row in rows), dtype="<f8")
    chosen = None if span is None else (time >= span[0]) & (time <= span[1])
    return (time if chosen is None else time[chosen]), chosen, [row["block"] for row in rows]


def _values(connection: sqlite3.Connection, channel_id: int, blocks: list[int]) -> Array:
    if not blocks:
        return np.empty(0)
    query = "SELECT block, data FROM sample_block WHERE channel_id = ? AND block BETWEEN ? AND ? ORDER BY block"
    wanted = set(blocks)
    pieces = [row["data"] for row in connection.execute(query, (channel_id, blocks[0], blocks[-1])) if row["block"] in wanted]
    return np.frombuffer(b"".join(pieces), dtype="<f8")
