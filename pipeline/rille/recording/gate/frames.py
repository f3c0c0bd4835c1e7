"""Does a gyro measure in the axes that the manifest says?"""

from collections.abc import Mapping, Sequence

from rille.model.recording import GateFinding
from rille.recording.gate.lag import Fit, fit_lag
from rille.recording.gate.relations import Pair
from rille.recording.gate.track import Track
from rille.recording.gate.turning import WHOSE, Turning

SURE = 0.9  # R^2 with the other axes
BETTER = 0.2  # of what the stated axes leave unexplained, that the others may


def check_frames(tracks: Mapping[str, Track], fits: Sequence[tuple[Pair, Fit]], turns: Mapping[str, Turning]) -> list[GateFinding]:
    """Angular velocities that are those about the body's axes and said to be about those of W, or the other way round."""
    found = []
    for pair, fit in fits:
        other = turns[pair.first].in_other_axes() if pair.first in turns else None
        rival = fit_lag(tracks[other.name], tracks[pair.second], pair.order) if other is not None and other.name in tracks else None
        if other is None or rival is None or rival.gain < 0 or rival.agreement < SURE or 1 - rival.agreement > BETTER * (1 - fit.agreement):
            continue
        stated = turns[pair.first].frame
        message = (
            f"'{pair.second}' turns about the {other.axis} axis of {WHOSE[other.frame]} (R^2 {rival.agreement:.3f} with orientation) and "
            f'not of {WHOSE[stated]}, as the manifest says ({max(fit.agreement, 0):.2f}); state frame = "{other.frame}"'
        )
        detail = {"first": pair.first, "second": pair.second, "agreement": fit.agreement, "other": rival.agreement, "frame": other.frame}
        found.append(GateFinding(code="frame", severity="error", channel=pair.second, detail=detail, message=message))
    return found
