"""Groups of verbs in which ``run`` need not be said."""

from pathlib import Path

from typer.core import TyperGroup


class RunByDefault(TyperGroup):
    """A first word that is no verb but names a file, and options before any word, are for ``run``."""

    def parse_args(self, ctx, args: list[str]) -> list[str]:
        first = args[0] if args else "--help"
        if first not in (*self.commands, "--help") and (first.startswith("-") or Path(first).suffix or Path(first).exists()):
            args = ["run", *args]
        return super().parse_args(ctx, args)
