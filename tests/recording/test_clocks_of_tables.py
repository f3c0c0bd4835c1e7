"""Are the clocks of one table kept apart: which samples are whose, and from which zero they count?"""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from recording_import import ANGLE, load, manifest
from rille import store
from rille.model import InputRefused

TWO = f"""{ANGLE}
[[channel]]
column = "i"
time = "slow"
quantity = "motor.current"
target = "knee"
unit = "A"
"""
TIME = '[time]\ncolumn = "fast"\norigin = "first"'
BEGIN = 1_767_225_600_000_000_000  # [ns] 2026-01-01
FAST, SLOW = 10_000_000 * np.arange(40), 50_000_000 * np.arange(8)  # [ns] from there


def filled(values, n=40):
    """A column with nothing (null) below its values."""
    return [*values, *[None] * (n - len(values))]


def dates(nanoseconds, zone="UTC"):
    """A column of time stamps."""
    stamps = [BEGIN + int(k) for k in nanoseconds]
    return pa.array(filled(stamps), pa.int64()).cast(pa.timestamp("ns", tz=zone))


def columns(fast, slow, i=None):
    """A table of two clocks, whose values are their own times [s]."""
    return {"fast": fast, "q": 1e-9 * FAST, "slow": slow, "i": filled(1e-9 * SLOW) if i is None else i}


def times(folder, table):
    """Times of both clocks [s] as they were stored."""
    pq.write_table(pa.table(table), folder / "d.parquet")
    load(manifest(folder, "d.parquet", channels=TWO, time=TIME), folder / "m.db")
    return [channel.time for channel in store.read_recording(folder / "m.db", "drive").channels]


@pytest.mark.parametrize("none", [np.nan, None])
def test_nan_and_null_are_no_sample_of_that_clock(tmp_path, none):
    slow = pa.array([*(1e-9 * SLOW), *[none] * 32], pa.float64())
    fast, found = times(tmp_path, columns(1e-9 * FAST, slow, pa.array([*(1e-9 * SLOW), *[none] * 32], pa.float64())))
    np.testing.assert_array_equal(fast, 1e-9 * FAST)
    np.testing.assert_array_equal(found, 1e-9 * SLOW)


@pytest.mark.parametrize(
    "slow", [pa.array(filled([0.0, np.nan, 0.1]), pa.float64()), dates([0]).take(pa.array([0, 1, 0, *[1] * 37]))], ids=["numbers", "dates"]
)
def test_a_value_without_a_time_names_the_row_and_the_column_of_the_clock(tmp_path, slow):
    """The second row has a current, but no time of it."""
    fast = 1e-9 * FAST if pa.types.is_floating(slow.type) else dates(FAST)
    with pytest.raises(InputRefused, match=r"row 2 of recording 'drive' has no time in column 'slow'.*'i'.*empty"):
        times(tmp_path, columns(fast, slow, filled([1.0, 2.0, 3.0])))


def test_rows_are_numbered_as_in_the_file_behind_such_that_are_no_sample(tmp_path):
    slow, i = filled([0.0, None, None, None]), filled([1.0, None, None, 4.0])
    with pytest.raises(InputRefused, match="row 4 "):
        times(tmp_path, columns(1e-9 * FAST, pa.array(slow, pa.float64()), i))


def test_two_clocks_of_dates_have_one_origin(tmp_path):
    fast, slow = times(tmp_path, columns(dates(FAST), dates(SLOW + 3_000_000)))
    np.testing.assert_allclose(fast, 1e-9 * FAST, atol=1e-12)
    np.testing.assert_allclose(slow, 1e-9 * SLOW + 0.003, atol=1e-12)


@pytest.mark.parametrize("end", ["{}", "{}Z", "{}+02"])
def test_two_clocks_of_dates_in_csv(tmp_path, end):
    """The clock that is slow begins in the second row."""
    stamp = [end.format(str(np.datetime64(BEGIN + int(k), "ns")).replace("T", " ")) for k in FAST]
    rows = [f"{stamp[k]},0.1,{stamp[k] if k % 5 == 1 else ''},{k if k % 5 == 1 else ''}" for k in range(40)]
    (tmp_path / "d.csv").write_text("fast,q,slow,i\n" + "\n".join(rows) + "\n")
    load(manifest(tmp_path, "d.csv", channels=TWO, time=TIME), tmp_path / "m.db")
    fast, slow = store.read_recording(tmp_path / "m.db", "drive").channels
    np.testing.assert_allclose(fast.time, 1e-9 * FAST, atol=1e-12)
    np.testing.assert_allclose(slow.time, 1e-9 * FAST[1::5], atol=1e-12)


@pytest.mark.parametrize("order", [1, -1])
def test_dates_and_numbers_have_no_common_zero(tmp_path, order):
    fast, slow = (dates(FAST), pa.array(1e-9 * FAST))[::order]
    with pytest.raises(InputRefused, match=r"'fast' and 'slow'.*'drive'.*dates.*numbers.*no common zero; write"):
        times(tmp_path, columns(fast, slow, 1e-9 * FAST))
