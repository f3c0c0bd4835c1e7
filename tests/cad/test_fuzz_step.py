"""Does any broken STEP file get past the child process? See fuzz_step.py; ``RILLE_FUZZ_STEP=10000`` for the whole of it."""

import os

import pytest

from cad import fuzz_step


def test_broken_files_end_in_a_reading_or_a_sentence(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache"))
    whole = int(os.environ.get("RILLE_FUZZ_STEP", "0"))
    budget = float("inf") if whole else 12.0
    tally = fuzz_step.fuzz(whole or 400, tmp_path, seed=0, budget=budget)
    with capsys.disabled():
        if whole:
            print(f"\n{sum(tally.outcomes.values())} files: {dict(tally.outcomes)}, longest {tally.worst:.1f} s")
    assert not tally.bugs, tally.bugs[0]
    # What crashed or was given up did so in a child, which the tool turns into a sentence (test_reading.py).
    assert tally.outcomes["read"] > 0
    assert tally.outcomes["refused"] > 0


def test_seeds_are_sound(tmp_path, monkeypatch):
    monkeypatch.setenv("RILLE_CACHE", str(tmp_path / "cache"))
    for index, text in enumerate(fuzz_step.seeds(tmp_path)):
        path = tmp_path / f"sound{index}.step"
        path.write_bytes(text)
        assert fuzz_step.read_in_fork(path) == "read"


@pytest.mark.parametrize("name", fuzz_step.MUTATIONS)
def test_every_mutation_changes_something(tmp_path, name):
    import numpy as np

    text = fuzz_step.seeds(tmp_path)[0]
    assert any(fuzz_step.MUTATIONS[name](text, np.random.default_rng(k)) != text for k in range(5))
