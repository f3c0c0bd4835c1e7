"""What a change of the code does to answers of an opened ledger is told in one word."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from rille.proof.scoring import Score

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmark/proof"))
import again

RIGHT = Score(
    trial=4, sort="one", machine="arm", strength=2.0, truth="drag of lower", status="done", verdict="named", answer="drag of lower",
    top=True, grouped=True, pieces=1.0, sort_right=True, probability=0.93, seconds=20.0,
)  # fmt: skip
IN_GROUP = replace(RIGHT, verdict="group", answer="friction of elbow", top=False, probability=0.47)
SILENT = replace(RIGHT, verdict="unknown", answer="", top=False, grouped=False, pieces=0.0, abstained=True, probability=float("nan"))
WRONG = replace(IN_GROUP, grouped=False, pieces=0.0, wrong=True)
SURE = replace(WRONG, verdict="named", confident_wrong=True, probability=0.93)
FROM_BAD_TO_GOOD = [SURE, WRONG, SILENT, IN_GROUP, RIGHT]


@pytest.mark.parametrize("k", range(1, len(FROM_BAD_TO_GOOD)))
def test_silence_is_better_than_a_wrong_name_and_worse_than_the_truth_in_a_group(k):
    before, now = FROM_BAD_TO_GOOD[k - 1].as_json(), FROM_BAD_TO_GOOD[k].as_json()
    assert again.compared(before, now).startswith("better")
    assert again.compared(now, before).startswith("WORSE")


def test_a_line_says_what_was_and_is_said():
    line = again.compared(SURE.as_json(), RIGHT.as_json())
    assert line == (
        "better        4 arm       one       x2   drag of lower: named friction of elbow 93 % (WRONG) -> named drag of lower 93 % (right),"
        " 20 s"
    )


def test_other_words_of_the_same_worth_are_told():
    assert again.compared(RIGHT.as_json(), RIGHT.as_json()).startswith("same ")
    assert again.compared(WRONG.as_json(), replace(WRONG, answer="drift of wrist").as_json()).startswith("other words")


def test_a_failure_has_its_status_in_the_place_of_a_verdict():
    failed = Score(trial=4, sort="one", machine="arm", strength=2.0, truth="drag of lower", status="too long")
    assert ": named drag of lower 93 % (right) -> too long" in again.compared(RIGHT.as_json(), failed.as_json())
