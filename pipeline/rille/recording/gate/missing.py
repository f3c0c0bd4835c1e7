"""Values that are missing or no numbers."""

import numpy as np

from rille.model.recording import Channel, GateFinding
from rille.recording.gate.runs import true_runs

LONGEST = 10  # samples in a row that a channel may miss
MOST = 0.2  # fraction of all samples


def check_missing(channel: Channel) -> list[GateFinding]:
    """Infinite values and runs of NaN; single missing values are a note."""
    value, time, found = channel.value, channel.time, []
    absent = np.isnan(value)
    infinite = int(np.isinf(value).sum())
    if infinite:
        message = f"channel '{channel.name}' has {infinite} infinite values of {len(value)}; repair the file"
        found.append(GateFinding(code="not_finite", severity="error", channel=channel.name, detail={"count": infinite}, message=message))
    count = int(absent.sum())
    if not count:
        return found
    first, last = true_runs(absent)
    length = last - first
    k = int(np.argmax(length))
    detail = {"count": count, "fraction": count / len(value), "runs": len(first), "longest": int(length[k]), "first": float(time[first[k]])}
    worst = np.sort(np.argsort(length)[::-1][:50])
    detail["intervals"] = [[float(time[first[j]]), float(time[last[j] - 1])] for j in worst]
    if length[k] <= LONGEST and count <= MOST * len(value):
        message = f"channel '{channel.name}' misses {count} of {len(value)} values, at most {length[k]} in a row"
        return found + [GateFinding(code="missing_single", severity="note", channel=channel.name, detail=detail, message=message)]
    message = (
        f"channel '{channel.name}' misses {count} of {len(value)} values, {length[k]} in a row from {time[first[k]]:.6g} s on; "
        'repair the file, set role = "ignore", or state missing = "accept" for this channel'
    )
    return found + [GateFinding(code="missing", severity="error", channel=channel.name, detail=detail, message=message)]
