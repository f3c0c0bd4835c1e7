"""Are residuals white? Ljung-Box pooled over windows, corrected for the start states that were fitted to them."""

import numpy as np
from scipy.stats import chi2

from rille.diagnosis.comparison.pooled import Pooled
from rille.model.difference import Whiteness

MOST_LAGS = 20
LEAST_PAIRS = 20


def whiteness(pooled: Pooled) -> Whiteness | None:
    """Correlation in time of the normalised residuals z; None if the windows are too short or too few to tell.

    With S_k = sum of z_i z_(i+k) over the pairs within one window, and V_k = sum of (z_i z_(i+k))^2, Q = sum of S_k^2 / V_k over lags k is
    chi-squared with as many degrees of freedom as lags if z is white, whatever its distribution and however its variance changes (Lobato,
    Nankervis, Savin 2001). Samples that are missing drop out of their pairs.

    The start state of a window is fitted to these residuals, which takes h_ij = (covariance of the start's share in samples i and j) out of
    their correlation: E[z_i z_j] = -h_ij. That share is smooth, so h_(i,i+k) is nearly start_i start_(i+k) for the few lags used here,
    and is put back.
    """
    finite = np.isfinite(pooled.z)
    counts = np.unique(pooled.window[finite], return_counts=True)[1]
    lags = int(min(MOST_LAGS, np.median(counts) // 5)) if len(counts) else 0
    z = np.where(finite, pooled.z, 0.0)
    start = np.where(finite, pooled.start, 0.0)
    total = float(np.sum(z**2) + np.sum(start**2))
    if lags < 1 or total == 0 or not np.isfinite(total):
        return None
    n = np.count_nonzero(finite)
    correlation, band, statistic = np.zeros(lags), np.zeros(lags), 0.0
    for k in range(1, lags + 1):
        pair = pooled.neighbours(k) & finite[k:] & finite[:-k]
        products = (z[k:] * z[:-k])[pair]
        taken = np.sum((start[k:] * start[:-k])[pair])
        spread = float(np.sum(products**2))
        if len(products) < LEAST_PAIRS or spread == 0:
            lags = k - 1
            break
        scale = n / len(products) / total
        sum_k = float(np.sum(products) + taken)
        correlation[k - 1] = sum_k * scale
        band[k - 1] = 1.96 * np.sqrt(spread) * scale
        statistic += sum_k**2 / spread
    if lags < 1:
        return None
    return Whiteness(
        autocorrelation=correlation[:lags],
        band=band[:lags],
        lags=lags,
        statistic=statistic,
        p=float(chi2.sf(statistic, lags)),
        lag1=float(correlation[0]),
        lag1_error=float(band[0] / 1.96),
    )
