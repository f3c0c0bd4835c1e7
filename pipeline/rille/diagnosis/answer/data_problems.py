"""What the data gate found in recordings that a diagnosis rests on, and which channels it takes out of it."""

from collections.abc import Sequence

from rille.diagnosis.comparison.compare import why_unfit
from rille.model.recording import Recording

DOUBTS = ("error", "warning")  # severities that are repeated
MOST_DOUBTS = 12
MOST_NAMES = 6


def data_problems(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Each sentence once."""
    said = dict.fromkeys(f.message for recording in recordings for f in recording.findings if f.severity in DOUBTS)
    return tuple(said)[:MOST_DOUBTS]


def took_no_part(recordings: Sequence[Recording]) -> str:
    """Which channels were not judged, and why; '' if all were."""
    whys: dict[str, set[str]] = {}
    for recording in recordings:
        for channel in recording.with_role("observed"):
            if why := why_unfit(channel, recording):
                whys.setdefault(why, set()).add(f"'{channel.name}'")
    told = [
        f"{', '.join(sorted(names)[:MOST_NAMES])}{' and more' if len(names) > MOST_NAMES else ''}: {why}" for why, names in whys.items()
    ]
    return f"took no part: {'; '.join(told)}" if told else ""
