"""Recordings as messages: MCAP and ROS 2 bags with messages of ROS 2, and ROS 1 bags."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rille.model import InputRefused
from rille.model.recording import ANGLES, Channel, Recording
from rille.recording.writing.address import Address

Send = Callable[[str, int, bytes], None]  # topic, stamp [ns], message


@dataclass(frozen=True, slots=True, kw_only=True)
class _Topic:
    """Channels that one message tells together. fields : where each stands in the message."""

    name: str
    kind: str
    channels: tuple[Channel, ...]
    fields: tuple[str, ...]


def write_messages(path: Path, recording: Recording, units: Mapping[str, tuple[str, float]]) -> dict[str, Address]:
    """One topic per sensor: JointState, PointStamped, QuaternionStamped, Vector3Stamped, or Float64 for a number alone.

    A message is logged at its stamp, and its header, where it has one, says the same. Samples that are missing are not sent.
    units : channel -> (unit, factor to SI).

    Raises
    ------
    InputRefused : for stamps before 0, which these formats cannot hold.
    """
    from rosbags.typesys import Stores, get_typestore

    first_ros = path.suffix.lower() == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if first_ros else Stores.ROS2_HUMBLE)
    topics = _topics(recording.channels)
    encode = store.serialize_ros1 if first_ros else store.serialize_cdr
    open_file = _ros1_bag if first_ros else _mcap if path.suffix.lower() == ".mcap" else _ros2_bag
    with open_file(path, [(topic.name, topic.kind) for topic in topics], store) as send:
        for topic, stamp, values in _in_order(topics, units):
            send(topic.name, stamp, bytes(encode(_message(store, topic, stamp, values), topic.kind)))
    return {
        channel.name: Address(column=f"{topic.name}.{field}", unit=units[channel.name][0], factor=units[channel.name][1])
        for topic in topics
        for channel, field in zip(topic.channels, topic.fields, strict=True)
    }


def _topics(channels: Sequence[Channel]) -> list[_Topic]:
    """Components of one vector that one clock stamps are one message; everything else is a message of its own."""
    groups: dict[tuple, list[Channel]] = {}
    for channel in channels:
        stem = channel.name.removesuffix(f"_{channel.component}")
        key = (stem, channel.quantity, channel.target, channel.frame, channel.clock) if channel.component else (channel.name,)
        groups.setdefault(key, []).append(channel)
    used: set[str] = set()
    topics = []
    for group in groups.values():
        stem = group[0].name.removesuffix(f"_{group[0].component}") if len(group) > 1 else group[0].name
        name = "/" + (re.sub(r"[^A-Za-z0-9_]+", "_", stem).strip("_") or "channel")
        if not name[1].isalpha():
            name = f"/c_{name[1:]}"
        while name in used:
            name += "_2"
        used.add(name)
        kind, fields = _kind(group)
        topics.append(_Topic(name=name, kind=kind, channels=tuple(group), fields=fields))
    return topics


def _kind(group: Sequence[Channel]) -> tuple[str, tuple[str, ...]]:
    """Type of the message, and the field of each channel."""
    quantity = group[0].quantity
    if quantity.startswith("joint.") and group[0].role == "observed":
        return "sensor_msgs/msg/JointState", (f"{quantity.partition('.')[2]}[0]",)
    if not group[0].component:
        return "std_msgs/msg/Float64", ("data",)
    components = [channel.component for channel in group]
    if components[0] in ANGLES:
        return "geometry_msgs/msg/Vector3Stamped", tuple(f"vector.{'xyz'[ANGLES.index(component)]}" for component in components)
    word = {"part.orientation": "quaternion", "part.position": "point"}.get(quantity, "vector")
    kind = {"quaternion": "QuaternionStamped", "point": "PointStamped", "vector": "Vector3Stamped"}[word]
    return f"geometry_msgs/msg/{kind}", tuple(f"{word}.{component}" for component in components)


def _in_order(topics: Sequence[_Topic], units: Mapping[str, tuple[str, float]]) -> Iterator[tuple[_Topic, int, list[float]]]:
    """Messages by their stamps [ns]: topic, stamp, values in the file's units."""
    stamps, numbers, rows, tables = [], [], [], []
    for number, topic in enumerate(topics):
        table = np.column_stack([channel.value / units[channel.name][1] for channel in topic.channels])
        sent = np.flatnonzero(np.isfinite(table).any(axis=1))
        stamp = np.round(topic.channels[0].time[sent] * 1e9).astype(np.int64)
        if (stamp < 0).any():
            raise InputRefused(
                f"channel '{topic.channels[0].name}' is stamped {stamp.min() / 1e9:g} s, and messages cannot be stamped before 0 s; "
                "write CSV or Parquet, or give its clock no negative offset"
            )
        stamps.append(stamp)
        numbers.append(np.full(len(sent), number))
        rows.append(sent)
        tables.append(table)
    if not stamps:
        return
    every, number_of, row_of = np.concatenate(stamps), np.concatenate(numbers), np.concatenate(rows)
    for k in np.argsort(every, kind="stable"):
        number = int(number_of[k])
        yield topics[number], int(every[k]), tables[number][row_of[k]].tolist()


def _message(store: Any, topic: _Topic, stamp: int, values: Sequence[float]) -> Any:
    types = store.types
    if topic.kind == "std_msgs/msg/Float64":
        return types[topic.kind](data=values[0])
    first_ros = "seq" in types["std_msgs/msg/Header"].__dataclass_fields__
    time = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    header = types["std_msgs/msg/Header"](stamp=time, frame_id=topic.channels[0].frame, **({"seq": 0} if first_ros else {}))
    if topic.kind == "sensor_msgs/msg/JointState":
        numbers = {name: np.empty(0) for name in ("position", "velocity", "effort")}
        numbers[topic.fields[0].removesuffix("[0]")] = np.array(values)
        return types[topic.kind](header=header, name=[topic.channels[0].target], **numbers)
    word = topic.fields[0].partition(".")[0]
    inner = {"quaternion": "Quaternion", "point": "Point", "vector": "Vector3"}[word]
    parts = dict.fromkeys("xyzw" if word == "quaternion" else "xyz", 0.0)
    parts |= {field.partition(".")[2]: value for field, value in zip(topic.fields, values, strict=True)}
    return types[topic.kind](header=header, **{word: types[f"geometry_msgs/msg/{inner}"](**parts)})


@contextmanager
def _ros1_bag(path: Path, topics: Sequence[tuple[str, str]], store: Any) -> Iterator[Send]:
    from rosbags.rosbag1 import Writer

    with Writer(path) as writer:
        connections = {name: writer.add_connection(name, kind, typestore=store) for name, kind in topics}
        yield lambda topic, stamp, data: writer.write(connections[topic], stamp, data)


@contextmanager
def _ros2_bag(path: Path, topics: Sequence[tuple[str, str]], store: Any) -> Iterator[Send]:
    from rosbags.rosbag2 import Writer

    with Writer(path, version=9) as writer:
        connections = {name: writer.add_connection(name, kind, typestore=store) for name, kind in topics}
        yield lambda topic, stamp, data: writer.write(connections[topic], stamp, data)


@contextmanager
def _mcap(path: Path, topics: Sequence[tuple[str, str]], store: Any) -> Iterator[Send]:
    from mcap.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="rille")
        texts = {kind: store.generate_msgdef(kind, ros_version=2)[0].encode() for _, kind in topics}
        schemas = {kind: writer.register_schema(kind, "ros2msg", text) for kind, text in texts.items()}
        channels = {name: writer.register_channel(name, "cdr", schemas[kind]) for name, kind in topics}
        yield lambda topic, stamp, data: writer.add_message(channels[topic], stamp, data, stamp)
        writer.finish()
