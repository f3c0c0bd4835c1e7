"""Files of the same small drive in every format that import reads."""

import json

import numpy as np

EPOCH = 1_700_000_000_123_456_789  # [ns]
N = 5000


def drive(seed=7, n=N):
    """Stamps [ns from the start], positions and velocities of two joints, x of a body: irregular, smooth."""
    rng = np.random.default_rng(seed)
    stamp = np.cumsum(rng.integers(800_000, 1_200_000, n)) - 800_000
    t = 1e-9 * stamp
    return stamp, np.stack([np.sin(t), np.cos(2 * t)], axis=1), np.stack([np.cos(t), -2 * np.sin(2 * t)], axis=1), 0.1 * t


def joint_state(types, stamp, position, velocity):
    """A message of ROS 1 or 2."""
    time = types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
    numbered = {"seq": 0} if "seq" in types["std_msgs/msg/Header"].__dataclass_fields__ else {}
    header = types["std_msgs/msg/Header"](stamp=time, frame_id="", **numbered)
    return types["sensor_msgs/msg/JointState"](
        header=header, name=["left", "right"], position=np.array(position), velocity=np.array(velocity), effort=np.empty(0)
    )


def write_bag(path, n=N):
    """ROS 1 bag (a file) or ROS 2 bag (a folder): /joint_states, logged 2 ms after its header says, and /x."""
    from rosbags.typesys import Stores, get_typestore

    first = path.suffix == ".bag"
    if first:
        from rosbags.rosbag1 import Writer

        store, options = get_typestore(Stores.ROS1_NOETIC), {}
    else:
        from rosbags.rosbag2 import Writer

        store, options = get_typestore(Stores.ROS2_HUMBLE), {"version": 9}
    encode = store.serialize_ros1 if first else store.serialize_cdr
    stamps, position, velocity, x = drive(n=n)
    with Writer(path, **options) as writer:
        joints = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
        place = writer.add_connection("/x", "std_msgs/msg/Float64", typestore=store)
        for k, stamp in enumerate((EPOCH + stamps).tolist()):
            message = joint_state(store.types, stamp, position[k], velocity[k])
            writer.write(joints, stamp + 2_000_000, bytes(encode(message, message.__msgtype__)))
            if k % 10 == 0:
                writer.write(
                    place, stamp + 2_000_000, bytes(encode(store.types["std_msgs/msg/Float64"](data=x[k]), "std_msgs/msg/Float64"))
                )
    return path


def write_mcap(path, encoding="json", n=N):
    """MCAP with the messages of the bags, in JSON, ROS 1 or ROS 2 (cdr)."""
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_typestore

    ros1 = encoding == "ros1"
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    stamps, position, velocity, x = drive(n=n)
    kinds = {"/joint_states": "sensor_msgs/msg/JointState", "/x": "std_msgs/msg/Float64"}
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channels = {}
        for topic, kind in kinds.items():
            if encoding == "json":
                schema = writer.register_schema(kind, "jsonschema", b'{"type": "object"}')
            else:
                text = store.generate_msgdef(kind, ros_version=1 if ros1 else 2)[0]
                schema = writer.register_schema(
                    kind.replace("/msg/", "/") if ros1 else kind, "ros1msg" if ros1 else "ros2msg", text.encode()
                )
            channels[topic] = writer.register_channel(topic, encoding, schema)
        for k, stamp in enumerate((EPOCH + stamps).tolist()):
            if encoding == "json":
                header = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}}
                data = {"header": header, "name": ["left", "right"], "position": position[k].tolist(), "velocity": velocity[k].tolist()}
                raw, place = json.dumps(data).encode(), json.dumps({"data": x[k]}).encode()
            else:
                encode = store.serialize_ros1 if ros1 else store.serialize_cdr
                message = joint_state(store.types, stamp, position[k], velocity[k])
                raw = bytes(encode(message, message.__msgtype__))
                place = bytes(encode(store.types["std_msgs/msg/Float64"](data=x[k]), "std_msgs/msg/Float64"))
            writer.add_message(channels["/joint_states"], stamp + 2_000_000, raw, stamp)
            if k % 10 == 0:
                writer.add_message(channels["/x"], stamp + 2_000_000, place, stamp)
        writer.finish()
    return path
