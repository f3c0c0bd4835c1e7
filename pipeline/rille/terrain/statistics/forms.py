"""What craters and rocks look like to the search, and how well it finds them."""

import numpy as np
from numpy.typing import NDArray

from rille.terrain.crater_laws import fresh_profile
from rille.terrain.statistics.matched import Found, Shape, search
from rille.terrain.statistics.samples import Surface

Array = NDArray[np.float64]

SMALLEST = 6.0  # diameter [postings] from which forms are told
LARGEST_ROCK = 20.0  # [m] larger bumps are hills


def cap(r: Array) -> Array:
    """Upper half of an ellipsoid, 0.4 diameters high: z / D = 0.4 sqrt(1 - r^2) (rocks stand 0.3 to 0.5 diameters above the ground)."""
    return 0.4 * np.sqrt(np.maximum(1.0 - np.asarray(r, np.float64) ** 2, 0.0))


CRATER = Shape(profile=fresh_profile, window=1.5, correlation=0.7, relief=0.1, prominence=4.0)
ROCK = Shape(profile=cap, window=1.6, correlation=0.8, relief=0.3, prominence=4.0)


def find_craters(surface: Surface, posting_x: float, posting_y: float) -> Found:
    """Craters from 6 postings to a third of the shorter side.

    Measured on Brownian ground (H = 0.8, median slope 3 deg) with Trask's law at full equilibrium density, 0.5 m posting: of fresh
    craters 79 % are found from 8 to 16 postings, 81 % to 32, 88 % beyond (60 % from 6 to 8); those missed are overlapped by others. Of
    craters worn to a steady state (3.5 Gyr) 35 % from 8 postings on, 46 % beyond 32, since most are shallower than a fiftieth of their
    diameter. 1 % of those found are none; ground without craters gives some 10 per 10^6 heights. Diameters come out 3 % low between
    others, with 9 % scatter; those of lone craters are right to 2 %.
    """
    side = min((surface.shape[0] - 1) * posting_y, (surface.shape[1] - 1) * posting_x)
    return search(surface, posting_x, posting_y, CRATER, SMALLEST * max(posting_x, posting_y), side / 3)


def find_rocks(surface: Surface, posting_x: float, posting_y: float) -> Found:
    """Rocks from 6 postings to 20 m: small bumps, at least 0.12 of their diameter high.

    Measured on Brownian ground with Golombek's law, k = 0.1, 0.1 m posting: of round rocks 77 % from 6 to 8 postings, 87 % beyond, none
    of those found is none; oblong ones (width 0.8 of the length) 46 and 80 %, their diameter the mean of both. Among saturated craters
    about three quarters of that, and 1 in 10 of those found is a rim.
    """
    side = min((surface.shape[0] - 1) * posting_y, (surface.shape[1] - 1) * posting_x)
    return search(surface, posting_x, posting_y, ROCK, SMALLEST * max(posting_x, posting_y), min(side / 10, LARGEST_ROCK))
