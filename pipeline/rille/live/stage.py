"""What a live session is made of, given to it: runs to steer and what is known of the model."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from rille.live.driving import DrivenWheel

Vector3 = tuple[float, float, float]


class SteeredRun(Protocol):
    """A run that goes as far as it is told; ``rille.simulate.steered_run`` makes them."""

    @property
    def id(self) -> int: ...
    @property
    def message(self) -> str: ...
    @property
    def steps_taken(self) -> int: ...
    @property
    def simulation(self) -> Any: ...

    def begin(self) -> str: ...
    def advance(self, count: int, to_event: bool = False) -> str: ...
    def finish(self, outcome: str = "done", message: str = "") -> None: ...
    def command(self, drive: str, value: float) -> None: ...
    def change(self, quantity: str, target: str, values: Sequence[float]) -> None: ...
    def log(self, received: str, sender: str, sequence: int | None, request: str, refused: str = "") -> None: ...
    def save(self, name: str) -> None: ...
    def flush(self) -> None: ...
    def events(self) -> list[tuple[float, str, str, str]]: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Opened:
    """A run and the name of its scenario."""

    run: SteeredRun
    scenario: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """fresh : begins a run at a place (x, y [m], heading [rad]; None: as the scenario says). loaded : goes on from a saved state.
    discard : forgets a scenario that was never run. saves : names of saved states. step : [s] of the runs.
    beyond_reach : of a drive, a set value and a time, what is said if the drive cannot follow it. wheels : for steering.
    origin : [m] that pictures are less of. objects : index of what can be read and set.
    """

    fresh: Callable[[tuple[float, float, float] | None], Opened]
    loaded: Callable[[str], Opened]
    discard: Callable[[str], None]
    saves: Callable[[], Sequence[str]]
    beyond_reach: Callable[[str, float, float], str | None]
    step: float
    wheels: tuple[DrivenWheel, ...]
    origin: Vector3
    objects: tuple[dict[str, Any], ...]
    on_ground: bool = True
