"""How a CSV is written is found out: a line of units below the names belongs to the header, a first row of data does not."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rille import store
from rille.model.csv_form import csv_form
from rille.simulate.bench_file import read_bench_csv


def form_of(tmp_path, text):
    path = tmp_path / "t.csv"
    path.write_text(text, encoding="utf-8")
    return csv_form(path)


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("time,angle,rate\ns,deg,deg/s\n0,1,2\n", ("time [s]", "angle [deg]", "rate [deg/s]")),
        ("Zeit;Winkel\n[s];[°]\n0,0;1,5\n", ("Zeit [s]", "Winkel [°]")),
        ("t,a\ns,m/s2\n0,1\n", ("t [s]", "a [m/s2]")),
        ("t,rate,T\ns,°/s,°C\n0,1,2\n", ("t [s]", "rate [°/s]", "T [°C]")),
        ("t,n\ns,counts\n0,1\n", ("t [s]", "n [counts]")),  # a unit that nobody knows loses no other, and is named
        ("time,slip,torque [N m]\n(s),-,N m\n0,0.1,2\n", ("time [s]", "slip", "torque [N m]")),
    ],
)
def test_a_line_of_units_names_the_units(tmp_path, text, columns):
    form = form_of(tmp_path, text)
    assert form.columns == columns
    assert (form.skip, len(form.rows)) == (2, 1)


@pytest.mark.parametrize(
    "text",
    [
        "time,angle\n0,1\n1,2\n",
        "wheel,slip\nleft,0.1\nright,0.2\n",  # labels
        "phase,note\ng,m\nm,s\n",  # no numbers below
        "time,angle\nNA,NA\n0.1,2\n",  # missing values
        "phase,v\nm,NA\n2,3\n",
        "wheel,phase,v\nleft,right,m\n0,1,2\n",  # most are no units
    ],
)
def test_a_row_of_data_is_none(tmp_path, text):
    form = form_of(tmp_path, text)
    assert form.skip == 1
    assert form.columns == tuple(text.splitlines()[0].split(","))


@pytest.mark.parametrize(
    ("text", "skip", "columns"),
    [
        ("Logger v3\nDate: 1.1.2024\n\nt,q,v\n0,1,2\n1,2,3\n", 4, ("t", "q", "v")),
        ("Operator: Smith, John\nt,q,v\n0,1,2\n", 2, ("t", "q", "v")),
        ("t,q\n0,1,\n1,2,\n", 1, ("t", "q")),  # a row of numbers is no header, however its commas are
        ("t\n0\n1\n", 1, ("t",)),
        ("# rover, run 3\n# t,q,v\n0,1,2\n1,2,3\n", 2, ("t", "q", "v")),  # numpy.savetxt
        ("# t q v\n0 1 2\n1 2 3\n", 1, ("t", "q", "v")),
        ("# t,q\ntime,angle\n0,1\n", 2, ("time", "angle")),
        ("t,q\n\ns,deg\n\n0,1\n", 3, ("t [s]", "q [deg]")),  # blank lines between
        ("logger\r\rt,q\r0,1\r", 3, ("t", "q")),
        ('logger\nt,"angle\n[deg]",v\n0,1,2\n1,2,3\n', 3, ("t", "angle [deg]", "v")),  # a line end in a name
        ('Wheel 6", run 3\n\nt,q,v\n0,1,2\n', 3, ("t", "q", "v")),
        ("t,q\x85b,v\n0,1,2\n", 1, ("t", "q\x85b", "v")),
    ],
)
def test_the_header_stands_below_what_a_logger_says_of_itself(tmp_path, text, skip, columns):
    form = form_of(tmp_path, text)
    assert (form.skip, form.columns) == (skip, columns)


@pytest.mark.parametrize("cell", ["1,5", "-0,000000e+00", "+,5", "1,40861E-3"])
def test_decimal_commas_are_found_wherever_they_begin(tmp_path, cell):
    """A hundred whole numbers first."""
    assert form_of(tmp_path, "t;q\n" + "".join(f"{k};0\n" for k in range(100)) + f"100;{cell}\n").decimal == ","
    assert form_of(tmp_path, "t;q\n0;1.5\n").decimal == "."


@pytest.mark.parametrize(("cell", "decimal"), [("1,5", ","), ("1.5", "."), ("7", "."), ('"-,5E3"', ",")])
def test_a_decimal_mark_may_come_after_a_long_rest(tmp_path, cell, decimal):
    """20000 rows at rest, 160 kB, of whole numbers, and a date of which no part is a number."""
    rest = "".join(f"{k:06d};2026-03-29 01:02:03.000,5;0\n" for k in range(20_000))
    assert form_of(tmp_path, f"t;date;x\n{rest}20000;;{cell}\n20001;;0\n").decimal == decimal


@pytest.mark.parametrize(
    ("text", "skip", "columns", "delimiter"),
    [
        ('t,x,note\n0.0,-6.9,"ok, moving"\n0.1,-6.8,"ok, moving"\n', 1, ("t", "x", "note"), ","),
        ('t;x;note\n0,5;1;"a, b, c; d"\n1,5;1;"a, b, c; d"\n', 1, ("t", "x", "note"), ";"),
        ('logger\n"time, UTC";"x, y, z"\n0;1\n1;2\n', 2, ("time, UTC", "x, y, z"), ";"),
        ('# t,x\n0,"1"\n1,"2"\n', 1, ("t", "x"), ","),
    ],
)
def test_delimiters_within_quotes_are_none(tmp_path, text, skip, columns, delimiter):
    form = form_of(tmp_path, text)
    assert (form.skip, form.columns, form.delimiter) == (skip, columns, delimiter)


@pytest.mark.parametrize(
    ("rows", "decimal"),
    [
        ('"0,000","-6,99"\n', ","),
        ('"0,050","1"\n', ","),
        ('"0.5","1,234"\n', "."),  # thousands beside a decimal point
        ('"1","1,234"\n"2","12,345,678"\n', "."),  # thousands, most likely: refused as no number
    ],
)
def test_decimal_commas_in_quotes(tmp_path, rows, decimal):
    assert form_of(tmp_path, '"t","x"\n' + rows).decimal == decimal


def test_a_bench_is_read_in_the_units_of_that_line(tmp_path):
    path = tmp_path / "b.csv"
    path.write_text("load,slip,sinkage,drawbar_pull\nkN,-,mm,N\n0.03,0.1,4,1\n0.03,0.2,5,2\n", encoding="utf-8")
    points = read_bench_csv(path)
    assert points.load == pytest.approx([30, 30])
    assert points.sinkage == pytest.approx([0.004, 0.005])


def test_a_recording_is_drafted_and_read_in_them(tmp_path):
    """50 samples, 10 ms apart, of up to 6 degrees."""
    (tmp_path / "r.csv").write_text("time,angle\nms,deg\n" + "".join(f"{10 * k},{abs(k % 12 - 6)}\n" for k in range(50)), encoding="utf-8")
    rille = str(Path(sys.executable).parent / "rille")
    for command in (["record", "new", "r.csv", "-o", "r.toml"], ["import", "r.toml", "-o", "r.db"]):
        subprocess.run([rille, *command], check=True, capture_output=True, timeout=120, cwd=tmp_path)
    (channel,) = store.read_recording(tmp_path / "r.db", "r").channels
    assert channel.time == pytest.approx(np.arange(50) / 100, abs=1e-12)
    assert channel.value.max() == pytest.approx(np.radians(6), abs=1e-12)
