"""Of laws that the fitted recordings do not tell apart, that one stands first which predicts what was held out."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from rille.diagnosis.answer import decide
from rille.diagnosis.inference.search import search
from toy_evidence import NAMES, catalogue, named, recorded

DRAG, VISCOUS = named("quadratic", "left", coefficient=0.2), named("viscous", "left", coefficient=0.2)
NOISE = {name: (1.0, "stated") for name in NAMES}
PARTS = SimpleNamespace(held_out=("one",))


def tied(first, second, **changed):
    """An answer whose group holds two laws, fitted to a recording of drag: ``first`` leads, the other is two nats behind."""
    found = search(recorded((DRAG,), seconds=10), [h for h in catalogue() if h.kind in ("viscous", "quadratic") and h.target == "left"])
    rows = {row.title: row for row in found.ranked}
    one, other = (rows[term.hypothesis.title] for term in (first, second))
    ranked = (
        replace(one, group=0, behind=0.0, probability=0.5, loses_because=""),
        replace(other, group=0, behind=2.0, probability=0.4, loses_because="it is behind"),
    )
    ranked = tuple(replace(row, **changed.get(row.title, {})) for row in ranked)
    return replace(found, verdict="group", ranked=ranked, terms=one.terms, setting=tuple(t.term for t in one.terms), groups=())


def after(found, monkeypatch, held_out):
    monkeypatch.setattr(decide, "gather", lambda *_, **__: held_out)
    return decide.decided(None, PARTS, found, noise=NOISE, window=0.5)


def test_what_predicts_held_out_recordings_stands_first(monkeypatch):
    """Another run with drag, which viscous friction fitted elsewhere misses by far more than the two nats."""
    found = after(tied(VISCOUS, DRAG), monkeypatch, recorded((DRAG,), seconds=10, seed=5))
    assert found.ranked[0].title == "quadratic of left"
    assert [t.hypothesis.kind for t in found.setting] == ["quadratic"]
    assert found.ranked[0].loses_because == ""
    assert "held out" in found.notes[-1]
    assert sum(row.probability for row in found.ranked) == pytest.approx(0.9)
    assert found.verdict == "group"


def test_who_leads_and_predicts_better_stays_first(monkeypatch):
    before = tied(DRAG, VISCOUS)
    found = after(before, monkeypatch, recorded((DRAG,), seconds=10, seed=5))
    assert found.setting == before.setting
    assert found.notes == before.notes
    assert found.ranked[0].probability > 0.89


def test_where_nothing_was_held_out_nothing_is_decided(monkeypatch):
    before = tied(VISCOUS, DRAG)
    monkeypatch.setattr(decide, "gather", lambda *_, **__: pytest.fail("nothing is replayed"))
    assert decide.decided(None, SimpleNamespace(held_out=()), before, noise=NOISE, window=0.5) is before


def test_a_number_of_the_model_gives_way_to_a_law_only_beyond_what_ties(monkeypatch):
    """Both predict the same: the number stays, though the law is a trifle ahead. Where the law is far ahead it is one of a group."""
    number = {"viscous of left": {"cause": "parameter"}}
    nearly = tied(VISCOUS, DRAG, **number, **{"quadratic of left": {"behind": 0.0}})
    rows = tuple(replace(row, terms=nearly.ranked[0].terms) for row in nearly.ranked)
    same = after(replace(nearly, verdict="parameter", ranked=rows), monkeypatch, recorded((DRAG,), seconds=10, seed=5))
    assert (same.verdict, same.ranked[0].title) == ("parameter", "viscous of left")
    found = after(replace(nearly, verdict="parameter"), monkeypatch, recorded((DRAG,), seconds=10, seed=5))
    assert (found.verdict, found.ranked[0].title) == ("group", "quadratic of left")


def test_what_says_nothing_does_not_come_to_the_front_by_a_trifle(monkeypatch):
    """Two that predict the same; the second is two nats ahead, but none of its numbers is told from absence."""
    found = tied(VISCOUS, DRAG, **{"viscous of left": {"behind": 2.0}, "quadratic of left": {"behind": 0.0}})
    first = found.ranked[0].terms
    told = tuple(replace(row, terms=first) for row in found.ranked)
    unsure = tuple(replace(term, estimates=tuple(replace(e, low=-1.0, high=1.0) for e in term.estimates)) for term in first)
    untold = (told[0], replace(told[1], terms=unsure))
    names = []
    for rows in (told, untold):
        held = recorded((DRAG,), seconds=10, seed=5)
        names.append(after(replace(found, ranked=rows), monkeypatch, held).ranked[0].title)
    assert names == ["quadratic of left", "viscous of left"]


@pytest.mark.parametrize(("behind", "first"), [(2.0, "limit of left"), (5.0, "limit of *")])
def test_a_law_at_all_targets_gives_way_to_the_same_at_one_unless_it_predicts_better(monkeypatch, behind, first):
    """Only the left cart meets its limit, in what was held out, too: there both say the same."""
    truth = (named("limit", "left", inverse=0.21),)
    found = search(recorded(truth, seconds=10), [h for h in catalogue() if h.kind == "limit"])
    (row,) = [row for row in found.ranked if row.title == "limit of left"]
    everywhere = tuple(replace(one, term=named("limit", "*", **one.term.numbers)) for one in row.terms)
    ranked = (replace(row, title="limit of *", terms=everywhere, group=0), replace(row, behind=behind, group=0))
    before = replace(found, verdict="group", ranked=ranked, groups=())
    assert after(before, monkeypatch, recorded(truth, seconds=10, seed=5)).ranked[0].title == first
