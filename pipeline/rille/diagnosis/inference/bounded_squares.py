"""Least squares within bounds from products alone."""

import numpy as np
from scipy.optimize import lsq_linear

from rille.diagnosis.evidence.evidence import Array

LEAST_CURVATURE = 1e-10  # of the largest, in scaled numbers; flatter directions are left alone


def bounded_minimum(gram: Array, slope: Array, lower: Array, upper: Array) -> tuple[Array, float]:
    """x in [lower, upper] of least x^T gram x + 2 slope^T x, and how far that is below x = 0 (which must be allowed).

    gram (k, k) symmetric, not negative; slope (k,). Directions without curvature stay at 0.
    """
    size = np.sqrt(np.maximum(np.diagonal(gram), 0.0))
    seen = size > 0
    x = np.zeros(len(slope))
    if not seen.any():
        return x, 0.0
    scale = size[seen]
    values, vectors = np.linalg.eigh(gram[np.ix_(seen, seen)] / np.outer(scale, scale))
    kept = values > LEAST_CURVATURE * values[-1]
    root = np.sqrt(values[kept])[:, None] * vectors[:, kept].T
    aim = -(vectors[:, kept].T @ (slope[seen] / scale)) / np.sqrt(values[kept])
    ends = (lower[seen] * scale, np.maximum(upper[seen] * scale, lower[seen] * scale + 1e-12))
    free = np.linalg.pinv(root) @ aim
    if np.any(free < ends[0]) or np.any(free > ends[1]):
        free = np.clip(lsq_linear(root, aim, bounds=ends, method="bvls").x, *ends)
    x[seen] = np.clip(free / scale, lower[seen], upper[seen])
    drop = -float(x @ gram @ x + 2 * slope @ x)
    return (x, drop) if drop > 0 else (np.zeros(len(slope)), 0.0)
