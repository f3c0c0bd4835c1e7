"""A study that is not finished is one of a part of its design: what waits has not failed."""

import re

import numpy as np
import pytest

from figures import figures_of
from rille.model.study import Factor, StudyTable
from rille.study import design_cases, indices, why_none
from rille.view import study_figures, study_report
from rille.view.study_words import part_of
from study.function_studies import angles, plan


def table(*status):
    """Cases of y = x1 that ended so."""
    asked = plan("latin_hypercube", len(status), angles(2))
    values = np.array([case.values for case in design_cases(asked, 2, 10_000)])
    return StudyTable(plan=asked, values=values, outcomes=values[:, :1], status=status, reason=("",) * len(status))


def page(study, folder):
    """The page of a study without indices, and with no reasons."""
    return study_report.write_study_report(folder / "s.html", study, {"y": None}, [], {}, []).read_text(encoding="utf-8")


def test_what_waits_has_not_failed(tmp_path):
    study = table("done", "waiting", "diverged", "done", "waiting")
    assert study.failed.tolist() == [False, False, True, False, False]
    assert part_of(study) == "of a part of the design (3 of 5 cases)"
    text = page(study, tmp_path)
    assert "of a part of the design (3 of 5 cases)" in text
    assert "2 of 3 cases went as planned" in text


def test_a_study_that_is_finished_says_nothing_of_parts(tmp_path):
    study = table("done", "done", "diverged")
    assert part_of(study) == ""
    text = page(study, tmp_path)
    assert "part of the design" not in text
    assert "2 of 3 cases went as planned" in text


@pytest.fixture
def drawn(monkeypatch):
    """The figures of a study, as they are drawn."""
    return figures_of(monkeypatch, study_figures)


@pytest.mark.parametrize(("status", "crosses"), [("waiting", 0), ("diverged", 3)])
def test_crosses_are_cases_that_failed(tmp_path, drawn, status, crosses):
    """The marks that the map draws with an x, and its title."""
    study_figures.draw_study(tmp_path, table("done", "done", *[status] * 3), {}, [])
    figure = drawn[0]
    marks = [line for axis in figure.axes for line in axis.lines if line.get_marker() == "x"]
    assert sum(len(line.get_xdata()) for line in marks) == crosses
    title = " ".join(figure.get_suptitle().split())  # it may take several lines
    assert ("part of the design (2 of 5 cases)" in title) == (status == "waiting")
    assert ("3 cases that did not go as planned" in title) == (status == "diverged")


def levels(*status):
    """A grid of a logarithmic factor of three values and another of two; y is the first."""
    factors = (
        Factor(name="mass", unit="kg", spread="log", low=0.1, high=10.0),
        Factor(name="g", unit="m/s^2", spread="values", values=(1.6, 9.8)),
    )
    asked = plan("grid", 0, factors)
    values = np.array([(mass, g) for mass in (0.1, 1.0, 10.0) for g in (1.6, 9.8)])
    return StudyTable(plan=asked, values=values, outcomes=values[:, :1], status=status, reason=("",) * 6)


def test_the_map_of_a_grid_has_a_cell_for_every_level(tmp_path, drawn):
    """Cells stand at the values that were run, whatever lies between; what has no value is told to be grey."""
    study_figures.draw_study(tmp_path, levels(*["done"] * 5, "diverged"), {}, [])
    axis = drawn[0].axes[0]
    assert [label.get_text() for label in axis.get_xticklabels()] == ["0.1", "1", "10"]
    assert [label.get_text() for label in axis.get_yticklabels()] == ["1.6", "9.8"]
    (cells,) = axis.collections
    np.testing.assert_array_equal(np.ma.filled(cells.get_array().reshape(2, 3), np.nan), [[0.1, 1, 10], [0.1, 1, np.nan]])
    assert axis.get_xlim() == (-0.5, 2.5)
    assert "grey: no value" in " ".join(drawn[0].get_suptitle().split())


def test_what_is_no_share_of_variance_is_not_called_one(tmp_path):
    """A grid with gaps has PAWN's indices; with three values it has none."""
    study = levels(*["done"] * 5, "diverged")
    one = indices(study, "y")
    assert not one.are_shares
    assert one.movers(2)[0] == 0
    text = study_report.write_study_report(tmp_path / "s.html", study, {"y": one}, [], {}, []).read_text(encoding="utf-8")
    assert "no share of variance)" in text
    assert "% of its variance" not in text
    few = levels(*["done"] * 3, *["diverged"] * 3)
    assert indices(few, "y") is None
    assert why_none(few, "y") == "4 cases needed"


def test_a_page_holds_2000_cases_and_says_so(tmp_path):
    text = page(table(*["done"] * 2100), tmp_path)
    assert "The first 2000 of 2100 cases" in text
    rows = re.findall(r"<tr[ >]", text[text.index("cases-table") :])
    assert 2000 <= len(rows) <= 2001
