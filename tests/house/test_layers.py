"""Layers point down: cli -> packages that know nothing of each other -> model, and the solver's rooms likewise."""

import ast
import re

import pytest

PACKAGES = (
    "store",
    "cad",
    "terrain",
    "recording",
    "simulate",
    "diagnosis",
    "view",
    "proof",
    "live",
    "study",
    "work",
)  # never import each other
RANK = {"model": 0, **dict.fromkeys(PACKAGES, 1), "cli": 2}
COMPILED = {"_solver": "simulate", "_terrain": "terrain"}  # compiled modules, and the only package that speaks to each
CPP_RANK = {
    "model": 0,
    "physics": 1,
    "terrain": 1,
    "store": 2,
    "world": 2,
    "effects": 2,
    "record": 3,
    "simulate": 3,
    "run": 4,
    "main": 5,
    "binding": 5,
}


def modules(repository):
    """(package, file) of every Python file of rille."""
    root = repository / "pipeline/rille"
    return [(file.relative_to(root).parts[0], file) for file in sorted(root.rglob("*.py")) if file.parent != root]


def imported_packages(file):
    """Names of the packages of rille that a file imports, at module level or inside functions."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == "rille":
            parts = node.module.split(".")
            yield from [parts[1]] if len(parts) > 1 else [alias.name for alias in node.names]
        elif isinstance(node, ast.Import):
            yield from [alias.name.split(".")[1] for alias in node.names if alias.name.startswith("rille.")]


def test_python_imports_only_point_down(repository):
    for package, file in modules(repository):
        for other in imported_packages(file):
            if other in ("__version__", package):
                continue
            if other in COMPILED:
                assert package == COMPILED[other], f"{file}: only {COMPILED[other]} speaks to {other}"
                continue
            assert other in RANK, f"{file} imports the unknown package {other}"
            assert RANK[other] < RANK[package], f"{file}: {package} must not import {other}"


def test_only_the_store_speaks_sql(repository):
    for package, file in modules(repository):
        text = file.read_text()
        if package != "store":
            assert "sqlite3" not in text, f"{file} imports sqlite3"
            assert not re.search(r"\b(SELECT .* FROM|INSERT INTO|CREATE TABLE)\b", text), f"{file} holds SQL"


def test_tables_are_created_in_one_place(repository):
    allowed = {"schema/schema.sql", "schema/ledger.sql", "schema/study.sql"}  # models; sealed trials; studies
    folders = ("pipeline", "solver", "schema", "examples", "terrain_library")
    for folder in folders:
        for file in (repository / folder).rglob("*"):
            name = str(file.relative_to(repository))
            if file.is_file() and file.suffix in (".py", ".sql", ".cpp", ".hpp") and not name.startswith("schema/migrations"):
                assert name in allowed or "CREATE TABLE" not in file.read_text(), name


def test_cpp_includes_only_point_down(repository):
    root = repository / "solver/src"
    for file in sorted([*root.rglob("*.hpp"), *root.rglob("*.cpp")]):
        room = file.relative_to(root).parts[0]
        for other in re.findall(r'#include "(\w+)/', file.read_text()):
            assert other == room or CPP_RANK[other] < CPP_RANK[room], f"{file}: {room} must not include {other}"


def test_only_the_world_knows_bullet(repository):
    for file in (repository / "solver/src").rglob("*"):
        if file.is_file() and file.parent.name != "world":
            assert not re.search(r"#include <Bullet|\bbtMultiBody\s*[*&{(]", file.read_text()), file


@pytest.mark.parametrize("folder", ["pipeline", "solver", "schema", "examples", "terrain_library", "tests", ".ci"])
def test_no_registry_is_named(repository, folder):
    hosts = re.compile("|".join(["pypi" + r"\.org", "files" + r"\.pythonhosted", "deb" + r"\.debian\.org", "registry" + r"\.npmjs"]))
    for file in (repository / folder).rglob("*"):
        if file.is_file() and file.suffix in (".py", ".txt", ".toml", ".md", ".cpp", ".hpp", ".cmake", ".sql", ""):
            assert not hosts.search(file.read_text(errors="ignore")), file
