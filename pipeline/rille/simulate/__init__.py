"""Runs the solver on a database, and reads scenario files."""

from rille.simulate.run import RunResult, run
from rille.simulate.scenario_file import read_scenario_file

__all__ = ["RunResult", "read_scenario_file", "run"]
