"""The format of a file by its ending."""

import shutil
from collections.abc import Mapping
from pathlib import Path

from rille.model import InputRefused, nearest_names
from rille.model.recording import Recording
from rille.recording.writing.address import Address

FORMATS = {".csv": "csv", ".parquet": "parquet", ".mcap": "mcap", ".bag": "rosbag", "": "rosbag"}  # no ending: the folder of a ROS 2 bag


def find_format(path: Path) -> str:
    """The format that the ending of a file asks for.

    Raises
    ------
    InputRefused : if there is none of that ending.
    """
    if path.suffix.lower() not in FORMATS:
        known = nearest_names(path.suffix, [ending for ending in FORMATS if ending])
        raise InputRefused(f"'{path}' ends in '{path.suffix}', which is no format of recordings here; {known} (no ending: a ROS 2 bag)")
    return FORMATS[path.suffix.lower()]


def write_recording_file(path: Path, recording: Recording, units: Mapping[str, tuple[str, float]] | None = None) -> dict[str, Address]:
    """Write a recording that is in memory, in the format of the ending.

    Parameters
    ----------
    units : channel -> (unit in the file, factor to SI), of those that are not written in SI.

    Returns
    -------
    Where each channel stands.

    Raises
    ------
    InputRefused : if the ending is unknown, the file cannot be written, or the format cannot hold the recording.
    """
    kind = find_format(path)
    chosen = {channel.name: (units or {}).get(channel.name, (channel.unit, 1.0)) for channel in recording.channels}
    try:
        if kind in ("csv", "parquet"):
            from rille.recording.writing.table import write_table

            return write_table(path, recording, chosen)
        from rille.recording.writing.messages import write_messages

        return write_messages(path, recording, chosen)
    except BaseException as error:
        _remove(path)  # half a recording would look like a whole one
        if not isinstance(error, OSError):
            raise
        raise InputRefused(f"'{path}' cannot be written: {error.strerror or error}; choose another place or make room") from None


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
