"""Tables of a wheel bench are read however they are written."""

import numpy as np
import pytest

from rille.cli.rig import read_points
from rille.model import InputRefused
from rille.model.bench import BenchWheel
from rille.simulate import bench_columns, read_bench_csv
from rille.simulate.bench_file import _unit


@pytest.mark.parametrize(
    ("column", "unit"),
    [
        ("torque [N m]", "N m"),
        ("torque (N m)", "N m"),
        ("torque [N*m]", "N m"),
        ("torque [N·m]", "N m"),
        ("Torque [Nm]", "N m"),
        ("torque_Nm", "N m"),
    ],
)
def test_a_bracket_is_the_unit(column, unit):
    assert _unit(column, "drive_torque") == unit


def test_semicolons_and_decimal_commas(tmp_path):
    path = tmp_path / "m.csv"
    path.write_text("load_N;slip;drawbar_pull_N\n30,5;0,1;-1,25\n30,5;0,2;2,5\n", encoding="utf-8-sig")
    points = read_bench_csv(path)
    assert points.load.tolist() == [30.5, 30.5]
    assert points.slip_ratio.tolist() == [0.1, 0.2]
    assert points.drawbar_pull.tolist() == [-1.25, 2.5]


def table(folder, text):
    """A file with a table."""
    path = folder / "bench.csv"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("header", "read"),
    [
        ("load_N,slip_angle,slip_ratio,sinkage_mm", {"slip_ratio": "slip_ratio [dimensionless]", "slip_angle": "slip_angle [rad]"}),
        ("load_case,load_N,slip_velocity,slip,sinkage_m", {"load": "load_N [N]", "slip_ratio": "slip [dimensionless]"}),
        (
            "load_lbf,slip_pct,torque_Ncm,sinkage_in",
            {"load": "load_lbf [lbf]", "drive_torque": "torque_Ncm [N cm]", "sinkage": "sinkage_in [in]"},
        ),
        ("Vertical Load [kN],Slip [%],DrawbarPull_N,torque_std", {"load": "Vertical Load [kN] [kN]", "drawbar_pull": "DrawbarPull_N [N]"}),
        ("load,slip,mean_sinkage_mm,sinkage_std_mm", {"sinkage": "mean_sinkage_mm [mm]"}),
    ],
)
def test_a_column_is_a_quantity_if_its_name_says_that_and_a_unit_of_it(tmp_path, header, read):
    found = bench_columns(table(tmp_path, f"{header}\n" + ",".join("1" for _ in header.split(","))))
    assert read.items() <= found.items()
    assert "torque_std" not in " ".join(found.values())


def test_units_at_the_ends_of_names_are_converted(tmp_path):
    points = read_bench_csv(table(tmp_path, "load_lbf,slip_pct,torque_Ncm,sinkage_in\n18,20,688,1.15\n"))
    assert points.load[0] == pytest.approx(18 * 4.4482216)
    assert (points.slip_ratio[0], points.drive_torque[0]) == (pytest.approx(0.2), pytest.approx(6.88))
    assert points.sinkage[0] == pytest.approx(1.15 * 0.0254)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("load_N,load_kN,slip,sinkage\n1,1,0,1\n", "'load_N' and 'load_kN' both say load.*--column load="),
        ("load_kg,slip,sinkage\n1,0,1\n", "load_kg.*--column load=load_kg:kgf"),
        ("load,slip,sinkage,sinkage\n1,0,1,2\n", "2 columns 'sinkage'"),
        ("load,slip,sinkage\n1,0,1\n0,0.1,1\n", "load in line 3.* is 0 N.*above 0"),
        ("load,slip,sinkage\n-1,0,1\n-2,0.1,1\n", "turn its sign"),
    ],
)
def test_what_is_ambiguous_or_cannot_be_is_refused(tmp_path, text, words):
    with pytest.raises(InputRefused, match=words):
        read_bench_csv(table(tmp_path, text))


def test_what_is_stated_needs_no_guess(tmp_path):
    path = table(tmp_path, "load_N,load_kN,Fz_kg,slip,sinkage\n1,2,3,0,1\n")
    assert read_bench_csv(path, {"load": "load_kN"}).load[0] == 2000
    assert read_bench_csv(path, {"load": "Fz_kg:kgf"}).load[0] == pytest.approx(3 * 9.80665)
    assert read_bench_csv(path, {"load": "64.7:N"}).load[0] == 64.7


HEADER = "load_N,slip,drawbar_pull_N,sinkage_mm\n"


@pytest.mark.parametrize(
    ("row", "fields"), [("25,0.24,5.6030,1,0.87", 5), ("25,0.24", 2), ("25,0.24,5.6,9,", 5)], ids=["shifted", "short", "long"]
)
def test_a_row_with_other_fields_than_the_header_is_refused(tmp_path, row, fields):
    with pytest.raises(InputRefused, match=f"line 3 of .* has {fields} fields, the header has 4"):
        read_bench_csv(table(tmp_path, f"{HEADER}25,0.1,2,9\n{row}\n25,0.3,6,9\n"))


def test_copies_of_rows_are_no_repeats(tmp_path, capsys):
    """Of 2 rows that are there again only one is left; a row that differs in any column of the file is a repeat."""
    rows = "25,0.1,2,9,a\n25,0.2,3,9,a\n25,0.1,2,9,b\n25,0.2,3,9,a\n"
    path = table(tmp_path, f"load_N,slip,drawbar_pull_N,sinkage_mm,run\n{rows}")
    assert read_bench_csv(path).slip_ratio.tolist() == [0.1, 0.2, 0.1]
    assert len(read_points(path, None, None, BenchWheel(radius=0.09, width=0.1))) == 3
    assert "1 rows of" in (told := capsys.readouterr().err)
    assert "line 5 is line 3" in told


def test_words_for_nothing_are_those_of_recordings(tmp_path):
    points = read_bench_csv(table(tmp_path, f"{HEADER}25,0.1,null,9\n25,0.2,n/a,9\n25,0.3,3,9\n"))
    assert np.isnan(points.drawbar_pull).tolist() == [True, True, False]


@pytest.mark.parametrize(("unit", "grousers", "told"), [("m", 0.0, "refused"), ("cm", 0.0, "told"), ("cm", 0.01, ""), ("mm", 0.0, "")])
def test_sinkage_beyond_the_wheel_is_told(tmp_path, capsys, unit, grousers, told):
    """9 to 9.5 of a unit, on a wheel of 90 mm: metres are beyond the diameter, 9.5 cm beyond the radius without grousers of 10 mm."""
    path = table(tmp_path, f"load_N,slip,sinkage_{unit}\n25,0.1,9\n25,0.2,9.5\n")
    wheel = BenchWheel(radius=0.09, width=0.1, grouser_height=grousers)
    if told == "refused":
        with pytest.raises(InputRefused, match=r"9.5 m as sinkage of a wheel whose radius is 0.09 m.*--column sinkage=NAME:mm"):
            read_points(path, None, None, wheel)
    else:
        read_points(path, None, None, wheel)
        assert ("0.095 m as sinkage" in capsys.readouterr().err) == bool(told)
