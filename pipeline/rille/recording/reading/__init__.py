"""Readers of files with samples: each yields pieces in bounded memory."""

from pathlib import Path

from rille.model.errors import InputRefused
from rille.recording.reading.piece import ROW, Labels, Piece, Source, Wanted, timed

ENDINGS = {
    **dict.fromkeys((".csv", ".tsv", ".txt", ".dat"), "csv"),
    **dict.fromkeys((".parquet", ".pq"), "parquet"),
    ".mcap": "mcap",
    **dict.fromkeys((".bag", ".db3"), "rosbag"),
}
NAMES = {"csv": "CSV (text)", "parquet": "Parquet", "mcap": "MCAP", "rosbag": "a ROS bag", "binary": "binary data of an unknown kind"}


def format_of(path: Path, stated: str | None = None) -> str:
    """Format of a file by its content: csv, parquet, mcap or rosbag (a ROS 2 bag is a folder with metadata.yaml).

    Raises
    ------
    InputRefused : if the content is none of these, or is not what the ending or the manifest says.
    """
    if path.is_dir():
        if not (path / "metadata.yaml").is_file():
            raise InputRefused(f"'{path}' is a folder without metadata.yaml, so it is no ROS 2 bag; name a file")
        found = "rosbag"
    else:
        found = _content(path)
    said = stated or ENDINGS.get(path.suffix.lower(), found)
    if found != said:
        who = f'the manifest says format = "{stated}"' if stated else f"its ending says {NAMES[said]}"
        raise InputRefused(f"'{path}' holds {NAMES[found]}, but {who}; rename the file, correct the manifest, or export it again")
    if found == "binary":
        raise InputRefused(f"'{path}' holds {NAMES[found]}; rille reads CSV, Parquet, MCAP and ROS 1 and 2 bags")
    return found


def _content(path: Path) -> str:
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except OSError as error:
        raise InputRefused(f"'{path}' cannot be read: {error}") from None
    if not head.strip():
        raise InputRefused(f"'{path}' is empty")
    for magic, kind in ((b"PAR1", "parquet"), (b"\x89MCAP0\r\n", "mcap"), (b"#ROSBAG V", "rosbag"), (b"SQLite format 3", "rosbag")):
        if head.startswith(magic):
            return kind
    return "binary" if b"\0" in head and head[:2] not in (b"\xff\xfe", b"\xfe\xff") else "csv"


def open_source(path: Path, stated: str | None = None) -> Source:
    """Open a file of samples.

    Raises
    ------
    InputRefused : if it is damaged, empty, or not what its ending or ``stated`` says.
    """
    kind = format_of(path, stated)
    if kind == "csv":
        from rille.recording.reading.csv_file import CsvSource

        return CsvSource(path)
    if kind == "parquet":
        from rille.recording.reading.parquet_file import ParquetSource

        return ParquetSource(path)
    if kind == "mcap":
        from rille.recording.reading.mcap_file import McapSource

        return McapSource(path)
    from rille.recording.reading.ros_bag import RosBagSource

    return RosBagSource(path)


__all__ = ["ROW", "Labels", "Piece", "Source", "Wanted", "format_of", "open_source", "timed"]
