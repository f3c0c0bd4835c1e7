"""``rille record``: recordings made, drafted, listed, checked, removed. Without a verb: a simulated run is recorded."""

import typer

from rille.cli import record_check, record_new, record_run
from rille.cli.default_verb import RunByDefault

app = typer.Typer(
    cls=RunByDefault,
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Recordings: make one of a simulated run, draft a manifest, list, check, remove. A file in place of a verb means `run`.\n\n"
    "Example: rille record rover.db --sensors sensors.toml -o drive.csv",
)
app.command("run")(record_run.run)
app.command("new")(record_new.new)
app.command("list")(record_new.list_recordings)
app.command("check")(record_check.check)
app.command("remove")(record_new.remove)
