"""Where a channel stands in a file."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Address:
    """column : name of the column, or ``/topic.field``. time : column with its stamps, of tables.

    unit, factor : of the file; value [SI] = factor x number.
    """

    column: str
    time: str = ""
    unit: str = ""
    factor: float = 1.0
