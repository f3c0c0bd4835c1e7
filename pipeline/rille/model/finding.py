"""What a diagnosis left in a database, and what applying it changes there. Values only."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """A diagnosis as it is kept.

    name : "diagnosis-1", given by the database. created : UTC, ISO 8601. verdict : as of ``model.diagnosis.VERDICTS``. target : name of
    what was named ('' if nothing was). probability : calibrated, None if none was stated. sentence : the answer.
    recordings, held_out : names. setting : what ``rille apply`` puts into the model; detail : the whole diagnosis; both plain JSON values.
    """

    verdict: str
    sentence: str
    name: str = ""
    created: str = ""
    target: str = ""
    probability: float | None = None
    recordings: tuple[str, ...] = ()
    held_out: tuple[str, ...] = ()
    setting: Sequence[Mapping[str, Any]] = ()
    detail: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class RowChange:
    """One value of a database that applying a finding changes. table, row : "soil", name of the row; column : "cohesion".

    before, after : in ``unit``; before is None where the row is new (an effect).
    """

    table: str
    row: str
    column: str
    before: float | None
    after: float
    unit: str = ""
