"""Tables of a wheel bench are read however they are written."""

import pytest

from rille.simulate.bench_file import _unit, read_bench_csv


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
