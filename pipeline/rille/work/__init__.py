"""Work on many items at once: processes of this machine or a Dask cluster. No worker's death loses an item.

Studies, sealed trials and replays of a diagnosis on a cluster go this way; what an item is, and what comes of it, this does not know.
"""

from rille.work.carry_out import carry_out
from rille.work.cluster import connected
from rille.work.pools import Batch, ClusterPool, LocalPool, opened_pool

__all__ = ["Batch", "ClusterPool", "LocalPool", "carry_out", "connected", "opened_pool"]
