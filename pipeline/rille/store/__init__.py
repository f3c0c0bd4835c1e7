"""The database: the only Python of rille that speaks SQL. See ``schema/README.md`` for the contract."""

from rille.store.bench import write_bench
from rille.store.database import beside, create, held_open, made_if_absent, migrate, remove_database, schema_version
from rille.store.effects import add_effect, check_effect, effect_kinds, find_effect_kind, read_effects, write_effects
from rille.store.findings import find_finding, read_findings, write_finding
from rille.store.health import check, info, units
from rille.store.improvement import improve, parameter_values, planned_changes
from rille.store.ledger import add_answer, create_ledger, open_truths, read_ledger, write_scores
from rille.store.model_copy import copy_model
from rille.store.model_digest import model_digest
from rille.store.parts import add_part, find_part, list_parts, part_library
from rille.store.recordings import (
    RecordingWriter,
    read_channel,
    read_recording,
    recording_clocks,
    recording_names,
    remove_recording,
    write_findings,
    write_recording,
)
from rille.store.results import RunRow, list_runs, read_reactions, read_ruts, read_samples, read_trace
from rille.store.rover import read_rover, write_rover
from rille.store.scenario import read_scenario, remove_scenario, resumable_scenarios, scenario_names, write_scenario
from rille.store.steering import LoggedCommand, SavedState, read_command_log, remove_unused, saved_states, write_continued, write_steered
from rille.store.study import (
    add_results,
    create_study,
    read_plan,
    read_study,
    read_traces,
    remove_study,
    study_held,
    wait_again,
    waiting_cases,
)
from rille.store.terrain import StoredWindow, read_soils, read_terrain, read_window, update_terrain, write_terrain

__all__ = [
    "LoggedCommand",
    "RecordingWriter",
    "RunRow",
    "SavedState",
    "StoredWindow",
    "add_answer",
    "add_effect",
    "add_part",
    "add_results",
    "beside",
    "check",
    "check_effect",
    "copy_model",
    "create",
    "create_ledger",
    "create_study",
    "effect_kinds",
    "find_effect_kind",
    "find_finding",
    "find_part",
    "held_open",
    "improve",
    "info",
    "list_parts",
    "list_runs",
    "made_if_absent",
    "migrate",
    "model_digest",
    "open_truths",
    "parameter_values",
    "part_library",
    "planned_changes",
    "read_channel",
    "read_command_log",
    "read_effects",
    "read_findings",
    "read_ledger",
    "read_plan",
    "read_reactions",
    "read_recording",
    "read_rover",
    "read_ruts",
    "read_samples",
    "read_scenario",
    "read_soils",
    "read_study",
    "read_terrain",
    "read_trace",
    "read_traces",
    "read_window",
    "recording_clocks",
    "recording_names",
    "remove_database",
    "remove_recording",
    "remove_scenario",
    "remove_study",
    "remove_unused",
    "resumable_scenarios",
    "saved_states",
    "scenario_names",
    "schema_version",
    "study_held",
    "units",
    "update_terrain",
    "wait_again",
    "waiting_cases",
    "write_bench",
    "write_continued",
    "write_effects",
    "write_finding",
    "write_findings",
    "write_recording",
    "write_rover",
    "write_scenario",
    "write_scores",
    "write_steered",
    "write_terrain",
]
