"""A Gaussian process on the residual: the missing forces as smooth functions of state and command, with no name for them.

Each input c of a complete set (joints, and the wrench on a free body; of points the responses) has a force f_c ~ GP(0, a^2 s_c^2 k(x, x')),
k squared exponential in the standardised features. Samples are linear in the forces, left = H f + noise of unit variance, so that

    E[f* | left] = K*. H^T (H K H^T + I)^-1 left

(Rasmussen & Williams 2006, eqs 2.25 and 9.8; linear functionals: Sarkka 2011). Amplitude and length scale have the largest marginal
likelihood; the kernel is scikit-learn's.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky
from scipy.stats import chi2 as chi2_distribution
from sklearn.gaussian_process.kernels import RBF

from rille.proof.baselines.names import BaselineAnswer
from rille.proof.baselines.residuals import ResidualTable, gap_closed

Array = NDArray[np.float64]
LENGTHS = np.geomspace(0.3, 40.0, 8)  # [-] that are tried, of standardised features
AMPLITUDES = np.geomspace(1e-3, 1e3, 61)  # [-] that are tried, of the forces that the samples would just show
CHANCE = 0.01  # of a false alarm
MOST_ROWS = 800  # numbers that are left of the samples; of longer recordings windows are left out, evenly
COARSE = 4  # parts of a window in which a force is one number
WEAK = 0.02  # of the strongest answer in a window, below which a direction is left out


def gaussian_process(training: ResidualTable, held_out: ResidualTable) -> BaselineAnswer:
    """How much of the gap a process closes that was fitted to the training; ``differs`` if it is likelier than noise alone."""
    before = held_out.size()
    training, held = _coarse(training), _coarse(held_out)
    chosen = _complete(training)
    names = _features(training)
    middle, spread = _standard(training, names)
    x = _states(training, names, middle, spread)
    scale = np.array([_just_seen(training, c) for c in chosen])
    rows, left, kept = _packed(training, chosen, scale)
    x = x[kept]

    def prior(length: float) -> Array:
        """Covariance of the packed samples without noise, for an amplitude of 1."""
        kernel = _kernel(length, x, x)
        return np.sum([half @ kernel @ half.T for half in rows], axis=0)

    best, length, amplitude = -np.inf, 0.0, 0.0
    for tried in LENGTHS:
        size, turn = np.linalg.eigh(prior(tried))
        along = (turn.T @ left) ** 2
        for a in AMPLITUDES:
            own = 1 + a**2 * np.maximum(size, 0.0)
            gain = 0.5 * float(np.sum(along * (1 - 1 / own) - np.log(own)))  # log likelihood over that of noise alone
            if gain > best:
                best, length, amplitude = gain, float(tried), float(a)
    factor = cholesky(amplitude**2 * prior(length) + np.eye(len(left)), lower=True)
    weights = cho_solve((factor, True), left)
    there = _states(held, names, middle, spread)
    cross = amplitude**2 * _kernel(length, there, x)
    predicted = np.zeros(len(held.left))
    for number, c in enumerate(chosen):
        force = scale[number] * (cross @ (rows[number].T @ weights))
        predicted += held.answer(c, force.reshape(held.shape))
    after = held.size(predicted)
    return BaselineAnswer(
        baseline="gaussian_process",
        name=None,
        number=float("nan"),
        differs=bool(2 * best > chi2_distribution.isf(CHANCE, 2)),
        before=before,
        after=after,
        gap_closed=gap_closed(before, after),
        detail=f"amplitude {amplitude:.3g}, length scale {length:.3g}, log likelihood ratio {best:.4g}",
    )


def _kernel(length: float, a: Array, b: Array) -> Array:
    """k of states (..., n_features)."""
    return np.asarray(RBF(length_scale=length)(a.reshape(-1, a.shape[-1]), b.reshape(-1, b.shape[-1])), dtype=float)


def _coarse(table: ResidualTable) -> ResidualTable:
    """The same in ``COARSE`` parts of a window at most."""
    n_windows, k = table.shape
    if k % COARSE or k <= COARSE:
        return table
    gain = table.gain.reshape(len(table.inputs), COARSE, k // COARSE, -1).sum(axis=2)
    features = {name: values.reshape(n_windows, COARSE, -1).mean(axis=2) for name, values in table.features.items()}
    return replace(table, gain=gain, features=features)


def _complete(table: ResidualTable) -> list[int]:
    """Numbers of inputs that together are every generalised force: joints and the wrench on the root; or responses."""
    root = table.scope.root
    return [k for k, one in enumerate(table.inputs) if one.kind in ("effort", "response") or (one.target == root and root)]


def _features(table: ResidualTable) -> list[str]:
    """State and command; where a machine is does not matter to a force, but for its tilt."""
    root = table.scope.root
    wanted = ("position", "velocity", "command", "load", "slip_ratio", "slip_angle", "turning_rate")
    found = [f for f in table.features if f.split("/")[0] in wanted and f.count("/") <= 1]
    if root:
        found += [f for f in table.features if f.startswith((f"velocity/{root}/", f"axis/{root}/z"))]
    return [f for f in found if float(np.std(table.features[f])) > 1e-9]


def _standard(table: ResidualTable, names: list[str]) -> tuple[Array, Array]:
    values = np.array([table.features[name].ravel() for name in names])
    return values.mean(axis=1), values.std(axis=1)


def _states(table: ResidualTable, names: list[str], middle: Array, spread: Array) -> Array:
    """(W, K, n_features) standardised."""
    return (np.stack([table.features[name] for name in names], axis=-1) - middle) / spread


def _just_seen(table: ResidualTable, number: int) -> float:
    """Constant force of an input that would change the samples by one sigma on average; 0: it does nothing here."""
    size = float(np.sqrt(np.mean(np.sum(table.gain[number], axis=0) ** 2)))
    return 1.0 / size if size > 0 else 0.0


def _packed(table: ResidualTable, chosen: list[int], scale: Array) -> tuple[list[Array], Array, NDArray[np.int64]]:
    """H of each chosen input (m, W' K), left (m,), and which W' windows: of the samples only what the forces change, m <= ``MOST_ROWS``."""
    n_windows, k = table.shape
    edges = np.searchsorted(table.window, np.arange(n_windows + 1))
    found = []
    for w in range(n_windows):
        here = slice(edges[w], edges[w + 1])
        gain = np.concatenate([scale[i] * table.gain[c, :, here] for i, c in enumerate(chosen)]).T  # (n, inputs x K)
        left, size, right = np.linalg.svd(gain, full_matrices=False)
        strong = size > WEAK * max(float(size.max(initial=0.0)), 1e-300)
        found.append((size[strong, None] * right[strong], left[:, strong].T @ table.left[here]))
    every = max(1, -(-sum(len(values) for _, values in found) // MOST_ROWS))
    kept = np.arange(0, n_windows, every)
    counts = np.cumsum([0, *(len(found[w][1]) for w in kept)])
    rows = [np.zeros((counts[-1], len(kept) * k)) for _ in chosen]
    for place, w in enumerate(kept):
        for i in range(len(chosen)):
            rows[i][counts[place] : counts[place + 1], place * k : (place + 1) * k] = found[w][0][:, i * k : (i + 1) * k]
    return rows, np.concatenate([found[w][1] for w in kept]), kept
