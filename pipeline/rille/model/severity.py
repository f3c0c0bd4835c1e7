"""How much a finding weighs: an error stops, a warning is said, a note informs."""

from typing import Literal, get_args

Severity = Literal["error", "warning", "note"]
SEVERITIES: tuple[Severity, ...] = get_args(Severity)  # worst first
