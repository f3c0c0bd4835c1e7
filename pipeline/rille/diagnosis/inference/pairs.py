"""Which two hypotheses together explain what none explains alone, from products of their signatures."""

import numpy as np

from rille.diagnosis.inference.screen import Screened, Signature

ALIKE = 0.98  # correlation of signatures beyond which two are not worth a joint fit
MOST = 200  # signatures that are paired, best first


def promising_pairs(screened: Screened, count: int) -> list[tuple[Signature, Signature, float]]:
    """The ``count`` pairs that promise the largest drop of chi-squared, with it; linear, signs respected.

    With directions d_i, d_j and residual w: least |w + x d_i + y d_j|^2, x >= 0 where direction i may not be turned.
    """
    loud = [s for s in screened.signatures if not s.silent and np.any(s.direction)][:MOST]
    if len(loud) < 2:
        return []
    columns = np.stack([s.direction for s in loud])
    gram = (columns @ columns.T).astype(float)
    slope = (columns @ screened.judge.base.astype(np.float32)).astype(float)
    size = np.sqrt(np.maximum(np.diagonal(gram), 1e-12))
    likeness = gram / np.outer(size, size)
    b = -slope / size
    one_sided = np.array([s.one_sided for s in loud])
    rest = np.maximum(1.0 - likeness**2, 1e-9)
    x = (b[:, None] - likeness * b[None, :]) / rest
    y = (b[None, :] - likeness * b[:, None]) / rest
    drop = x * b[:, None] + y * b[None, :]
    allowed = ~(one_sided[:, None] & (x <= 0)) & ~(one_sided[None, :] & (y <= 0)) & (np.abs(likeness) < ALIKE)
    drop = np.where(np.triu(allowed, 1), drop, -np.inf)
    order = np.argsort(-drop, axis=None, kind="stable")[:count]
    found = [(int(k // len(loud)), int(k % len(loud))) for k in order if np.isfinite(drop.flat[k])]
    return [(loud[i], loud[j], float(drop[i, j])) for i, j in found]
