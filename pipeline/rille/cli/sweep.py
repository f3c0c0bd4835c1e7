"""``rille sweep``: studies over anything that a model, a soil, a scenario, a landform or an effect has. Without a verb: a study is run."""

import os
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rille.cli.default_verb import RunByDefault
from rille.cli.places import require_folder, require_place
from rille.cli.talk import Json, print_json, progress, say

if TYPE_CHECKING:
    from rille.cli.sweep_prepare import Prepared
    from rille.model.study import CaseResult, StudyPlan
    from rille.study import StudySheet

TOLD = 15.0  # [s] between lines of progress where stderr is no terminal
COLUMNS = ("case", "status", "reason")  # that results have besides factors and outcomes

Figures = Annotated[Path | None, typer.Option(help="Folder for figures (PNG) and study.html, a page that works offline.")]
Parquet = Annotated[Path | None, typer.Option(help="Parquet file: a row per case, a column per factor and outcome.")]

app = typer.Typer(
    cls=RunByDefault,
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Studies: a thousand cases of a model in which something varies, on all cores or a cluster.\n\n"
    "Example: rille sweep examples/sweep/soft_ground.toml --figures out/soft_ground",
)


@app.command("run")
def run(
    source: Annotated[Path, typer.Argument(help="Study sheet (TOML), or a database with a model and --vary.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Study (SQLite); default: SHEET.study.db beside the sheet.")] = None,
    vary: Annotated[
        list[str] | None, typer.Option(help='"NAME=LOW:HIGH" or "NAME=VALUE,VALUE", repeatable, of a database instead of a sheet.')
    ] = None,
    scenario: Annotated[str | None, typer.Option(help="With --vary: scenario file, or a name in the database.")] = None,
    design: Annotated[str | None, typer.Option(help="With --vary: grid, latin_hypercube or sobol.")] = None,
    samples: Annotated[int | None, typer.Option(help="With --vary: base samples.")] = None,
    seed: Annotated[int | None, typer.Option(help="With --vary: seed of the design.")] = None,
    workers: Annotated[int | None, typer.Option(help="Processes on this machine; default: one for each core.", min=1)] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler to spread cases over: tcp://HOST:8786.")] = None,
    figures: Figures = None,
    parquet: Parquet = None,
    force: Annotated[
        bool, typer.Option("--force", help="Begin anew where the file holds another study, or a damaged one; its results are deleted.")
    ] = False,
    retry: Annotated[
        bool,
        typer.Option("--retry", help="Run cases again that were refused, had an error or lost their worker (its memory was full, say)."),
    ] = False,
    as_json: Json = False,
) -> None:
    """Run a study. What is done is kept: after Ctrl-C or kill -9 the same command goes on where it was. A case that fails is a row with its
    reason.

    Example: rille sweep run examples/sweep/soft_ground.toml --figures out/soft_ground
    Example: rille sweep rover.db --vary "soil.*.cohesion=0 Pa:1 kPa" --vary "start.heading=0 deg,45 deg,90 deg" --samples 200
    Example: rille sweep study.toml --scheduler tcp://cluster:8786 --parquet study.parquet
    """
    from rille.cli.sweep_ground import require_sendable
    from rille.cli.sweep_prepare import prepare

    sheet = _sheet(source, vary, {"scenario": scenario, "design": design, "samples": samples, "seed": seed})
    path = output or source.with_suffix(".study.db")
    require_folder(path)
    _require_places(figures, parquet, reads=[source])
    with progress(f"study '{sheet.name}'") as update:
        prepared = prepare(sheet, source.parent if vary is None else Path(), update)
        _require_columns(prepared)
        if scheduler is not None:
            require_sendable(prepared.work.scene)
        _begin(path, prepared, force)
        try:
            _carry_out(path, prepared, workers or len(os.sched_getaffinity(0)), scheduler, update, retry=retry)
        except KeyboardInterrupt:
            say("finished cases are kept; the same command goes on from there")
            raise
    _show(path, figures, parquet, as_json)


@app.command("show")
def show(
    study: Annotated[Path, typer.Argument(help="Study (SQLite) that `rille sweep run` made, finished or not.")],
    figures: Figures = None,
    parquet: Parquet = None,
    as_json: Json = False,
) -> None:
    """What a study found: outcomes, which factor moves them, cases that failed and why.

    Example: rille sweep show examples/sweep/soft_ground.study.db --figures out/soft_ground
    """
    _require_places(figures, parquet)
    _show(study, figures, parquet, as_json)


def _sheet(source: Path, vary: list[str] | None, options: dict[str, Any]) -> "StudySheet":
    """The study that is asked for."""
    from rille.model import InputRefused
    from rille.study import read_study_sheet, study_of_options

    if vary is not None:
        return study_of_options(source, vary, options)
    if source.suffix == ".db":
        raise InputRefused(f"'{source}' is a database; say what varies: --vary \"soil.*.cohesion=0 Pa:1 kPa\", or name a study sheet")
    given = [f"--{key}" for key, value in options.items() if value is not None]
    if given:
        raise InputRefused(f"{given[0]} belongs to --vary; of a study sheet, write it into '{source}'")
    return read_study_sheet(source)


def _require_places(figures: Path | None, parquet: Path | None, reads: Iterable[Path] = ()) -> None:
    """Refuse at once what would fail at the end."""
    from rille.model import InputRefused

    require_place(parquet, reads=reads)
    if figures is not None and figures.exists() and not figures.is_dir():
        raise InputRefused(f"'{figures}' is a file; name a folder for --figures")


def _require_columns(prepared: "Prepared") -> None:
    """Every outcome is a column of its own in results, where neither capitals nor spelling tell it from another."""
    from rille.model import InputRefused

    plan = prepared.plan
    names = [*COLUMNS, *(factor.name for factor in plan.factors), *(measure.name for measure in plan.measures)]
    for channel in prepared.work.channels:  # the outcomes that somebody named
        twins = [name for name in names if name.casefold() == channel.name.casefold()]
        if len(twins) > 1:
            other = next((name for name in twins if name != channel.name), channel.name)
            raise InputRefused(f"the outcome '{channel.name}' and the column '{other}' of results have one name; give the outcome another")


def _begin(path: Path, prepared: "Prepared", force: bool) -> None:
    """The study's file with its design, unless there is one already."""
    from rille import store

    if force and path.exists() and _is_another(path, prepared.plan):
        store.remove_study(path)
    if not path.exists():
        store.create_study(path, prepared.plan, prepared.cases)


def _is_another(path: Path, asked: "StudyPlan") -> bool:
    """Whether a file does not hold the study that is asked for: another one, or nothing that can be read."""
    from rille import store
    from rille.model import InputRefused

    try:
        return bool(_difference(store.read_plan(path), asked))
    except InputRefused:
        return True


def _difference(kept: "StudyPlan", asked: "StudyPlan") -> str:
    """What a kept study and the one that is asked for do not have in common, in words; '' if they are the same."""
    words = []
    if kept.sheet != asked.sheet:
        words.append("another sheet")
    if kept.model != asked.model:
        words.append("another model, scenario or ground")
    if kept.version != asked.version:
        words.append(f"another rille ({kept.version}, this is {asked.version})")
    return " and ".join(words)


def _carry_out(path: Path, prepared: "Prepared", workers: int, scheduler: str | None, update: Any, *, retry: bool) -> None:
    """Run what is waiting. retry : and what failed."""
    from rille import store
    from rille.model import InputRefused
    from rille.model.study import lost_case
    from rille.work import carry_out, opened_pool

    with store.study_held(path):
        differs = _difference(store.read_plan(path), prepared.plan)
        if differs:
            raise InputRefused(f"'{path}' holds a study of {differs}; --force begins anew and deletes its results, or choose another -o")
        if retry:
            say(f"{store.wait_again(path)} cases that failed wait again")
        waiting = store.waiting_cases(path)
        if not waiting:
            return
        total, before = len(prepared.cases), len(prepared.cases) - len(waiting)
        if before:
            say(f"{before} of {total} cases are done already")
        begin = told = time.monotonic()

        def tell(done: int) -> None:
            nonlocal told
            update(f"{before + done} of {total}", (before + done) / total)
            if not os.isatty(2) and time.monotonic() - told > TOLD:
                told = time.monotonic()
                left = (told - begin) / done * (len(waiting) - done)
                say(f"{before + done} of {total} cases, about {left:.0f} s left")

        def keep(results: "Sequence[CaseResult]") -> None:
            store.add_results(path, prepared.plan, results)

        update(f"{before} of {total}", before / total)
        with opened_pool(prepared.work, min(workers, len(waiting)), scheduler) as pool:
            carry_out(pool, prepared.ordered(waiting), len(waiting), keep, lost=lost_case, tell=tell)
        seconds = time.monotonic() - begin
        say(f"{len(waiting)} cases in {seconds:.1f} s ({len(waiting) / seconds:.1f} per second)")


def _show(path: Path, figures: Path | None, parquet: Path | None, as_json: bool) -> None:
    """Results on stdout, and into the files that are asked for."""
    from rille import store
    from rille.cli.sweep_results import found, json_of, lines_of, write_figures, write_parquet

    table = store.read_study(path)
    results = found(table)
    files = []
    if parquet is not None:
        files.append(write_parquet(parquet, table))
    if figures is not None:
        traces = {channel.name: store.read_traces(path, channel.name) for channel in table.plan.traced}
        files += write_figures(figures, table, results, traces)
    if as_json:
        print_json({"study": str(path), **json_of(table, results), "files": [str(file) for file in files]})
    else:
        print("\n".join(lines_of(table, results)))
    for file in files:
        say(f"wrote {file}")
    if table.waiting.any():
        say(f"{table.waiting.sum()} cases are still waiting; `rille sweep run` goes on")
    say(f"all cases are in {path} (view result)")
