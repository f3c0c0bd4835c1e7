"""One effect, one name, four rooms: the catalogue, the solver, its file, its test."""

from rille import _solver, store

HELPERS = {"registry", "formula", "dimension"}  # rooms of all laws, no laws


def test_catalogue_solver_files_and_tests_name_the_same_effects(repository):
    catalogue = [kind.name for kind in store.effect_kinds()]
    assert catalogue == _solver.known_effects()
    assert set(catalogue) == {file.stem for file in (repository / "solver/src/effects").glob("*.cpp")} - HELPERS
    assert set(catalogue) == {file.stem.removeprefix("test_") for file in (repository / "tests/effects").glob("test_*.py")} - {
        "every_effect"
    }


def test_every_law_has_an_amplitude_and_a_source():
    for kind in store.effect_kinds():
        assert any(p.amplitude for p in kind.parameters), kind.name
        assert kind.source, kind.name
        for p in kind.parameters:
            assert p.lower <= p.typical <= p.upper, (kind.name, p.name)
            assert not p.amplitude or p.lower <= 0 <= p.upper, (kind.name, p.name)
            assert not p.amplitude or p.search == "local", (kind.name, p.name)
