"""What the data gate found in recordings that a diagnosis rests on."""

from collections.abc import Sequence

from rille.model.recording import Recording

DOUBTS = ("error", "warning")  # severities that are repeated
MOST_DOUBTS = 12


def data_problems(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Each sentence once."""
    said = dict.fromkeys(f.message for recording in recordings for f in recording.findings if f.severity in DOUBTS)
    return tuple(said)[:MOST_DOUBTS]
