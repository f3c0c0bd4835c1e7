"""The list of trials that did not go as they were to go."""

import pytest

from rille.proof.failures import failures, failures_markdown
from rille.proof.scoring import Score


def line(trial, sort="one", strength=2.0, status="done", verdict="named", **more):
    """A score as the ledger holds it."""
    return Score(trial=trial, sort=sort, machine="arm", strength=strength, truth="t", status=status, verdict=verdict, **more).as_json()


@pytest.mark.parametrize(
    ("failed", "one"),
    [
        (False, line(1, top=True, grouped=True)),
        (True, line(1, grouped=True)),  # strong, and only in the group
        (False, line(1, strength=1.0, grouped=True)),  # weak: no aim speaks of it
        (False, line(1, strength=0.5, verdict="unknown", abstained=True)),
        (True, line(1, strength=0.5, wrong=True)),  # a wrong name is one at any strength
        (True, line(1, strength=0.5, status="crashed", verdict="")),
        (True, line(1, sort="nothing", strength=0.0, verdict="unknown", abstained=True)),
        (False, line(1, sort="nothing", strength=0.0, verdict="nothing_missing", top=True, grouped=True)),
        (True, line(1, sort="outside", strength=0.5, verdict="nothing_missing", abstained=True)),
        (False, line(1, sort="outside", strength=5.0, verdict="unknown", abstained=True, top=True, grouped=True)),
    ],
)
def test_what_counts_as_a_failure(failed, one):
    assert bool(failures([one])) is failed


def test_the_list_says_what_was_concealed_and_what_was_said():
    lines = [
        line(7, sort="outside", verdict="group", answer="drag", wrong=True, confident_wrong=True, probability=0.93),
        line(3, grouped=True, verdict="group", answer="mass", probability=0.5),
        line(5, status="too long", verdict=""),
    ]
    rows = failures_markdown(lines).splitlines()[2:]
    assert rows == [
        "| 3 | arm | t at 2 | group: mass, 50 % | truth in the group |",
        "| 5 | arm | t at 2 | too long |  |",
        "| 7 | arm | t (not in the catalogue) at 2 | group: drag, 93 % | **confident and wrong** |",
    ]
    assert failures_markdown([line(1, top=True)]) == "Every trial went as it was to go.\n"
