"""The verbs, and the one place that turns outcomes into exit codes and sentences."""

import gc
import os
import sys
from typing import Annotated, Any

import typer
import typer.main

from rille import __version__
from rille.cli import (
    apply,
    bench,
    cad,
    compare,
    db,
    diagnose,
    effects,
    import_recording,
    prove,
    record,
    replay,
    run,
    serve,
    soil,
    sweep,
    terrain,
    view,
)
from rille.model import InputRefused, PhysicsFailed

DONE, BUG, USAGE, REFUSED, PHYSICS, INTERRUPTED = 0, 1, 2, 3, 4, 130

app = typer.Typer(
    name="rille",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Planetary-rover simulation: CAD assembly + terrain -> one SQLite database -> solver -> results.\n\n"
    "Example: rille cad build examples/rover/rover.toml -o rover.db",
)
app.add_typer(cad.app, name="cad")
app.add_typer(terrain.app, name="terrain")
app.add_typer(soil.app, name="soil")
app.command("bench")(bench.bench)
app.add_typer(effects.app, name="effects")
app.command("run")(run.run)
app.command("view")(view.view)
app.command("replay")(replay.replay)
app.command("serve")(serve.serve)
app.command("compare")(compare.compare)
app.command("diagnose")(diagnose.diagnose)
app.command("apply")(apply.apply)
app.command("import")(import_recording.import_recording)
app.add_typer(record.app, name="record")
app.add_typer(sweep.app, name="sweep")
app.add_typer(prove.app, name="prove")
app.add_typer(db.app, name="db")


def _print_version(wanted: bool) -> None:
    if wanted:
        print(__version__)
        raise typer.Exit


@app.callback()
def _options_before_the_verb(
    version: Annotated[bool, typer.Option("--version", is_eager=True, callback=_print_version, help="Print the version and exit.")] = False,
) -> None:
    """Options of rille itself."""


@app.command("version")
def version() -> None:
    """Print the version.

    Example: rille version
    """
    print(__version__)


def main() -> None:
    """Run the command line and exit: 0 done, 1 our bug, 2 usage, 3 input refused, 4 physics did not converge, 130 interrupted."""
    gc.set_threshold(50_000, 20, 50)  # rille makes few cycles and much that lives long: looking for them at every 700th object costs 6 %
    sys.exit(_run())


def _run() -> int:
    try:
        command = _with_examples_on_lines(typer.main.get_command(app))
        with command.make_context("rille", sys.argv[1:]) as context:  # its main() would swallow Ctrl-C
            result = command.invoke(context)
        return result if isinstance(result, int) else DONE
    except InputRefused as refusal:
        return _say(str(refusal), REFUSED)
    except PhysicsFailed as failure:
        return _say(str(failure), PHYSICS)
    except (KeyboardInterrupt, typer.Abort):
        return _say("interrupted; what was written before is complete", INTERRUPTED)
    except typer.Exit as ended:
        return ended.exit_code
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the reader left; nothing more to say
        return DONE
    except Exception as error:
        show = getattr(error, "show", None)  # click's usage errors know how to print themselves
        if show is not None:
            show()
            return USAGE
        if os.environ.get("RILLE_DEBUG"):
            raise
        return _say(f"unexpected {type(error).__name__}: {error}; this is a bug of rille (RILLE_DEBUG=1 shows where)", BUG)


def _with_examples_on_lines(command: Any) -> Any:
    """The command and all below it, with every example of their help on a line of its own: click would fill them into one paragraph."""
    for below in getattr(command, "commands", {}).values():
        _with_examples_on_lines(below)
    paragraphs = (command.help or "").split("\n\n")
    command.help = "\n\n".join(f"\b\n{one}" if one.startswith("Example:") else one for one in paragraphs)
    return command


def _say(sentence: str, code: int) -> int:
    print("rille: " + " ".join(sentence.splitlines()), file=sys.stderr)  # names and files that it quotes may hold line ends
    return code
