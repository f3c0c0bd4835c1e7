"""``rille db``: look after a database."""

from pathlib import Path
from typing import Annotated

import typer

from rille.cli.talk import Json, print_json, say

MOST_NAMES = 40  # of one kind that are told

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Look into a database, check it, migrate it.\n\nExample: rille db check rover.db",
)
Database = Annotated[Path, typer.Argument(help="Database of rille.")]


@app.command("check")
def check(database: Database, as_json: Json = False) -> int:
    """Check that a database hangs together; exit code 3 if it does not.

    Example: rille db check rover.db
    """
    from rille import store

    problems = store.check(database)
    if as_json:
        print_json({"database": str(database), "problems": problems})
    elif problems:
        for problem in problems:
            print(problem)
    else:
        say(f"{database}: no problems")
    return 3 if problems else 0


@app.command("info")
def info(
    database: Database,
    units: Annotated[bool, typer.Option("--units", help="Unit and meaning of every column, as the file keeps them.")] = False,
    as_json: Json = False,
) -> None:
    """Say what is in a database.

    Example: rille db info rover.db --units
    """
    from rille import store

    if units:
        table = store.units(database)
        if as_json:
            print_json(table)
            return
        for name, columns in table.items():
            print(name)
            for column, meaning in columns.items():
                print(f"    {column:<26} {meaning}")
        return
    facts = store.info(database)
    if as_json:
        print_json(facts)
        return
    print(f"{facts['file']}: schema {facts['schema_version']}, {facts['bytes'] / 1e6:.1f} MB, {facts['total_mass_kg']:.2f} kg in all")
    for what, names in facts["names"].items():
        if names:
            more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
            print(f"{what:<10} {', '.join(names[:MOST_NAMES])}{more}")
    for run in facts["runs"]:
        print(f"run {run['id']:<6} {run['status']}, {run['time_reached']:g} s {run['message']}".rstrip())
    for source in facts["sources"]:
        print(f"source     {source['subject']}: {source['file']} (sha256 {source['sha256'][:12]}, {source['tool']})")


@app.command("migrate")
def migrate(database: Database, as_json: Json = False) -> None:
    """Bring a database of an older version of rille to the present schema.

    Example: rille db migrate old.db
    """
    from rille import store

    before, after = store.migrate(database)
    if as_json:
        print_json({"database": str(database), "before": before, "after": after})
        return
    say(f"{database}: schema {before} -> {after}" if before != after else f"{database}: already at schema {after}")
