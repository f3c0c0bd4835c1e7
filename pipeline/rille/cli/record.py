"""``rille record``: recordings made, drafted, listed, checked, removed. Without a verb: a simulated run is recorded."""

from pathlib import Path

import typer
from typer.core import TyperGroup

from rille.cli import record_check, record_new, record_run


class _Default(TyperGroup):
    """A first word that is no verb but names a file, and options before any word, are for ``run``."""

    def parse_args(self, ctx, args: list[str]) -> list[str]:
        first = args[0] if args else "--help"
        if first not in (*self.commands, "--help") and (first.startswith("-") or Path(first).suffix or Path(first).exists()):
            args = ["run", *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=_Default,
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
