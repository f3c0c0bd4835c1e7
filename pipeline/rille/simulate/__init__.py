"""Runs the solver: on a database as a program, or in process as a bench and in short windows."""

from rille.simulate.bench import BenchResult, bench, bench_at, effect_rows
from rille.simulate.bench_file import bench_columns, bench_csv_lines, read_bench_csv
from rille.simulate.replay import Replayer
from rille.simulate.run import RunResult, run
from rille.simulate.scenario_file import read_scenario_file, surface_gravity
from rille.simulate.sensitivity import sensitivities
from rille.simulate.steered import steered_run
from rille.simulate.unheeded import beyond_reach, unheeded

__all__ = [
    "BenchResult",
    "Replayer",
    "RunResult",
    "bench",
    "bench_at",
    "bench_columns",
    "bench_csv_lines",
    "beyond_reach",
    "effect_rows",
    "read_bench_csv",
    "read_scenario_file",
    "run",
    "sensitivities",
    "steered_run",
    "surface_gravity",
    "unheeded",
]
