"""Does every format give the numbers that were written, to the bit?"""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from recording_files import EPOCH, drive, write_bag, write_mcap
from rille.model import InputRefused
from rille.recording.reading import Wanted, format_of, open_source
from rille.recording.reading.address import parse_address

COLUMNS = ("/joint_states.position[0]", "/joint_states.velocity[right]")


def gather(source, wanted):
    """All pieces of each clock joined: stamps and columns."""
    stamps, columns = {}, {}
    for piece in source.pieces(wanted):
        stamps.setdefault(piece.clock, []).append(piece.time)
        for name, value in piece.values.items():
            columns.setdefault(name, []).append(value)
        assert 0 <= piece.done <= 1
    return {c: np.concatenate(t) for c, t in stamps.items()}, {c: np.concatenate(v) for c, v in columns.items()}


@pytest.mark.parametrize("kind", ["json", "ros1", "cdr", "bag", "folder"])
@pytest.mark.parametrize("header", [False, True])
def test_messages_come_back_to_the_bit(tmp_path, kind, header):
    path = (
        write_mcap(tmp_path / "d.mcap", kind, n=900)
        if kind in ("json", "ros1", "cdr")
        else write_bag(tmp_path / ("d.bag" if kind == "bag" else "d"), n=900)
    )
    source = open_source(path)
    stamp, position, velocity, x = drive(n=900)
    assert not source.table
    assert source.topic(COLUMNS[0]) == "/joint_states"
    clocks = {"/joint_states": COLUMNS} if header else {"/joint_states": COLUMNS, "/x": ("/x.data",)}
    stamps, columns = gather(source, Wanted(clocks=clocks, header=header))
    np.testing.assert_array_equal(stamps["/joint_states"], EPOCH + stamp + (0 if header else 2_000_000))
    np.testing.assert_array_equal(columns[COLUMNS[0]], position[:, 0])
    np.testing.assert_array_equal(columns[COLUMNS[1]], velocity[:, 1])
    if not header:
        np.testing.assert_array_equal(columns["/x.data"], x[::10])


def test_an_entry_that_a_message_lacks_is_missing(tmp_path):
    source = open_source(write_mcap(tmp_path / "d.mcap", "cdr", n=20))
    _, columns = gather(source, Wanted(clocks={"/joint_states": ("/joint_states.effort[0]",)}))
    assert np.isnan(columns["/joint_states.effort[0]"]).all()


def test_unknown_topics_and_fields_are_refused(tmp_path):
    source = open_source(write_bag(tmp_path / "d.bag", n=20))
    with pytest.raises(InputRefused, match=r"no topic '/joint_state'.*'/joint_states'"):
        source.check(["/joint_state.position[0]"])
    with pytest.raises(InputRefused, match=r"no number 'positon\[0\]'.*position\[0\]"):
        source.check(["/joint_states.positon[0]"])
    with pytest.raises(InputRefused, match="names no field"):
        parse_address("/x.da[ta", {"/x": ""}, "d.bag")


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " "])
def test_csv_comes_back_to_the_bit(tmp_path, delimiter):
    rng = np.random.default_rng(3)
    table = rng.normal(size=(20_000, 3)) * 10.0 ** rng.integers(-8, 8, (20_000, 3))
    lines = ["# logged by somebody", delimiter.join(["t", "a" if delimiter == " " else " a ", '"b"'])] + [
        delimiter.join(f"{v!r}" for v in row.tolist()) for row in table
    ]
    path = tmp_path / "d.csv"
    path.write_text("\ufeff" + "\n".join(lines) + "\n", encoding="utf-8")
    stamps, columns = gather(open_source(path), Wanted(clocks={"t": ("a", "b")}))
    np.testing.assert_array_equal(np.stack([stamps["t"], columns["a"], columns["b"]], axis=1), table)


@pytest.mark.parametrize(
    "header",
    ["t,q,v\n\ns,deg,m/s\n", 't,"q\n[deg]",v\n', "# t,q,v\n", "words\n# of a logger\n\nt,q,v\n"],
    ids=["blank", "broken", "comment", "words"],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"], ids=["lf", "crlf"])
def test_rows_begin_where_the_header_ends(tmp_path, header, end):
    """The first row is neither lost nor taken for a part of the header."""
    path = tmp_path / "d.csv"
    path.write_text(header + "0,1,2\n1,2,3\n", newline=end)
    source = open_source(path)
    clock, *columns = source.columns
    stamps, read = gather(source, Wanted(clocks={clock: tuple(columns)}))
    assert stamps[clock].tolist() == [0, 1]
    assert [read[name].tolist() for name in columns] == [[1, 2], [2, 3]]


def test_a_csv_with_decimal_commas(tmp_path):
    path = tmp_path / "d.csv"
    path.write_text("t;a\n0,0;1,5\n0,1;-2,25\n")
    stamps, columns = gather(open_source(path), Wanted(clocks={"t": ("a",)}))
    assert stamps["t"].tolist() == [0.0, 0.1]
    assert columns["a"].tolist() == [1.5, -2.25]


def test_csv_stamps_of_nanoseconds_keep_every_digit(tmp_path):
    path = tmp_path / "d.csv"
    path.write_text(f"t,a\n{EPOCH},1\n{EPOCH + 1},2\n")
    stamps, _ = gather(open_source(path), Wanted(clocks={"t": ("a",)}))
    assert (stamps["t"] - EPOCH).tolist() == [0, 1]


def test_dates_are_stamps(tmp_path):
    path = tmp_path / "d.csv"
    path.write_text("t,a\n2024-05-01 10:00:00.000,1\n2024-05-01 10:00:00.250,2\n")
    stamps, _ = gather(open_source(path), Wanted(clocks={"t": ("a",)}))
    assert np.diff(stamps["t"]).tolist() == [250_000_000]


@pytest.mark.parametrize("zone", ["", "Z", "+00:00", "+0000", "+00", " UTC", " GMT", " Z", "-02", " +02:00"])
@pytest.mark.parametrize("spelling", ["2024-05-01T{}:00:00.{}", "2024-05-01 {}:00:00,{}", "2024/05/01 {}:00:00.{}"])
def test_dates_are_read_however_they_are_spelt(tmp_path, spelling, zone):
    """250 ms apart, with decimal commas beside a comma in the date."""
    rows = "".join(f"{spelling.format(10, part)}{zone};{a}\n" for part, a in (("000", "1,5"), ("250", "2,5")))
    (tmp_path / "d.csv").write_text(f"t;a\n{rows};\n")
    stamps, columns = gather(open_source(tmp_path / "d.csv"), Wanted(clocks={"t": ("a",)}))
    shift = {"-02": 12, " +02:00": 8}.get(zone, 10)
    assert stamps["t"].tolist() == [np.datetime64(f"2024-05-01T{shift:02d}:00:00.{part}", "ns").astype(int) for part in ("000", "250")]
    assert columns["a"].tolist() == [1.5, 2.5]


@pytest.mark.parametrize(
    ("first", "second", "words"),
    [
        ("2024-05-01T10:00:00", "2024-05-01T10:00:01Z", "says its zone, unlike the first; write all with a zone"),
        ("2024-05-01T10:00:00Z", "2024-05-01T10:00:01", "says no zone, unlike the first"),
        ("2024-05-01T10:00:00", "2024-02-30T10:00:01", "no calendar has; dates are read as 2024-03-31T00:59:55.005Z"),
        ("2024-05-01T10:00:00", "0001-02-03T10:00:01", "is beyond what time stamps hold .1678 to 2261"),
        ("2024-05-01T10:00:00", "2024-05-01T10:00:60", "is beyond .* seconds below 60"),
        ("2024-05-01T10:00:00", "1.5.2024 10:00:01", "is no date; dates are read as"),
        ("2024-05-01T10:00:00", "17", "is no date"),
        ("0.5", "2024-05-01T10:00:00", "is no number; dates are read as"),
    ],
)
def test_a_date_that_cannot_be_read_is_told_with_its_line(tmp_path, first, second, words):
    (tmp_path / "d.csv").write_text(f"t,a\n{first},1\n{second},2\n")
    with pytest.raises(InputRefused, match=f"line 3, column 't' of .* is '{second}', which {words}"):
        gather(open_source(tmp_path / "d.csv"), Wanted(clocks={"t": ("a",)}))


def test_two_decimal_marks_are_told(tmp_path):
    """A comma anywhere in the beginning decides."""
    (tmp_path / "d.csv").write_text("t;a\n0;1.5\n1;0,5\n")
    with pytest.raises(InputRefused, match=r"line 2, column 'a' of .* is '1.5', which has a decimal point, unlike .*; write all with one"):
        gather(open_source(tmp_path / "d.csv"), Wanted(clocks={"t": ("a",)}))


def test_commas_in_quotes_are_no_delimiters(tmp_path):
    (tmp_path / "d.csv").write_text('t,x,note\n0.0,-6.5,"ok, moving"\n0.5,-6.25,"ok, moving"\n')
    stamps, columns = gather(open_source(tmp_path / "d.csv"), Wanted(clocks={"t": ("x",)}))
    assert (stamps["t"].tolist(), columns["x"].tolist()) == ([0, 0.5], [-6.5, -6.25])
    (tmp_path / "q.csv").write_text('"t","x"\n"0,000","-6,500"\n"0,500","-6,250"\n')
    stamps, columns = gather(open_source(tmp_path / "q.csv"), Wanted(clocks={"t": ("x",)}))
    assert (stamps["t"].tolist(), columns["x"].tolist()) == ([0, 0.5], [-6.5, -6.25])


def test_decimal_commas_after_a_long_rest(tmp_path):
    (tmp_path / "d.csv").write_text("t;x\n" + "".join(f"{k};0\n" for k in range(20_000)) + "20000;0,25\n")
    _, columns = gather(open_source(tmp_path / "d.csv"), Wanted(clocks={"t": ("x",)}))
    assert columns["x"][-2:].tolist() == [0, 0.25]


def test_durations_are_stamps(tmp_path):
    table = pa.table({"t": pa.array([0, 1500], pa.duration("us")), "a": pa.array([1.0, 2.0])})
    pq.write_table(table, tmp_path / "d.parquet")
    (piece,) = open_source(tmp_path / "d.parquet").pieces(Wanted(clocks={"t": ("a",)}))
    assert piece.time.tolist() == [0, 1_500_000]
    assert piece.tick == 1e-9


def test_parquet_types_and_missing_values(tmp_path):
    table = pa.table(
        {
            "t": pa.array(np.arange(4, dtype=np.float32)),
            "a": pa.array([1, None, 3, 4], pa.int16()),
            "on": pa.array([True, False, True, True]),
            "run": pa.array(["x", "x", "y", "y"]).dictionary_encode(),
        }
    )
    pq.write_table(table, tmp_path / "d.parquet")
    (piece,) = open_source(tmp_path / "d.parquet").pieces(Wanted(clocks={"t": ("a", "on")}, labels=("run",)))
    np.testing.assert_array_equal(piece.values["a"], [1, np.nan, 3, 4])
    assert piece.values["on"].tolist() == [1, 0, 1, 1]
    assert [piece.labels["run"].known[c] for c in piece.labels["run"].code] == ["x", "x", "y", "y"]


def test_two_clocks_in_one_table_end_at_different_rows(tmp_path):
    path = tmp_path / "d.csv"
    path.write_text("t1,a,t2,b\n0,1,0.5,10\n1,2,1.5,20\n2,3,,\n")
    stamps, columns = gather(open_source(path), Wanted(clocks={"t1": ("a",), "t2": ("b",)}))
    assert stamps["t2"].tolist() == [0.5, 1.5]
    assert columns["b"].tolist() == [10, 20]
    assert columns["a"].tolist() == [1, 2, 3]


def test_formats_are_told_by_content(tmp_path):
    pq.write_table(pa.table({"t": [1.0]}), tmp_path / "d.parquet")
    assert format_of(tmp_path / "d.parquet") == "parquet"
    (tmp_path / "d.parquet").rename(tmp_path / "recording")
    assert format_of(tmp_path / "recording") == "parquet"
    assert format_of(write_bag(tmp_path / "d", n=5)) == "rosbag"
    assert format_of(write_bag(tmp_path / "d.bag", n=5)) == "rosbag"
    assert format_of(write_mcap(tmp_path / "d.mcap", n=5)) == "mcap"
