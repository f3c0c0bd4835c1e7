"""Runs that are steered while they go: hooks of a Python file, a live session, its server and its client."""

from rille.live.driving import DrivenWheel, driven_wheels, set_values
from rille.live.hooks import Hooks, Steering, at, every, on_event, read_hooks, when
from rille.live.stage import Opened, Stage, SteeredRun

__all__ = [
    "DrivenWheel",
    "Hooks",
    "Opened",
    "Stage",
    "SteeredRun",
    "Steering",
    "at",
    "driven_wheels",
    "every",
    "on_event",
    "read_hooks",
    "set_values",
    "when",
]
