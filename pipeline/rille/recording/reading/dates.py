"""Dates of text files: as loggers write them -> time stamps."""

import re
from datetime import datetime
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pyarrow as pa

ZONE = r" ?(?:Z|UTC|GMT|[+-]\d\d(?::?\d\d)?)"
DATE = re.compile(rf"\d{{4}}([-/])\d\d\1\d\d[T ]\d\d:\d\d(?::\d\d(?:[.,]\d{{1,9}})?)?(?P<zone>{ZONE})?")
LIKE = re.compile(r"\d[:./-]\d+[:./-]\d")  # a date or a time of day, however it is written
EXAMPLE = "2024-03-31T00:59:55.005Z"
YEARS = (1678, 2261)  # that 64 bits of nanoseconds hold
SPELLINGS = ((" *(?:UTC|GMT)$", "Z"), (" +([Z+-][0-9:]*)$", r"\1"), ("/", "-"), (",", "."))  # what is written, as ISO 8601 writes it


def zoned(text: str) -> bool:
    """Whether a date says its zone."""
    match = DATE.fullmatch(text)
    return match is not None and match["zone"] is not None


def stamps_of(column: "pa.Array", *, zone: bool) -> "pa.Array":
    """Time stamps [ns] of a column of text, null where that is null. zone : whether its dates say their zone; without one they are UTC.

    Raises
    ------
    pa.ArrowInvalid : for a text that is no such date.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    of = pa.timestamp("ns", tz="UTC" if zone else None)
    try:
        return column.cast(of)
    except pa.ArrowInvalid:
        column = pc.utf8_trim_whitespace(column)  # pyright: ignore[reportAttributeAccessIssue]
        for written, iso in SPELLINGS:
            column = pc.replace_substring_regex(column, written, iso)  # pyright: ignore[reportAttributeAccessIssue]
        return column.cast(of)


def no_date(text: str, *, zone: bool) -> str:
    """Why a text is none of the dates of a column, as the end of a sentence; "" if it is one. zone : whether the first of them says its."""
    match = DATE.fullmatch(text)
    like = f"dates are read as {EXAMPLE}"
    if match is None:
        return f"which is no date; {like}"
    if (match["zone"] is not None) != zone:
        return f"which says {'no zone, unlike' if zone else 'its zone, unlike'} the first; write all with a zone ({EXAMPLE}), or none"
    try:
        datetime.fromisoformat(re.sub(r"[T /]", "-", text[:10]) + "T" + text[11:16])
    except ValueError:
        return f"which no calendar has; {like}"
    if not YEARS[0] <= int(text[:4]) <= YEARS[1] or text[17:19] > "59":
        return f"which is beyond what time stamps hold ({YEARS[0]} to {YEARS[1]}, seconds below 60)"
    return ""
