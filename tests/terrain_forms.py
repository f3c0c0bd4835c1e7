"""Small landforms of known shape."""

import numpy as np

from rille.model import LandformInstance, Population
from rille.terrain.crowd import Crowd
from rille.terrain.landform import Landform, Radial
from rille.terrain.placed import Placed


def form(blend="add", crowd="add", **more):
    """A block of 2 m x 1 m, 0.5 m high; radial: a paraboloid."""
    options = {
        "name": blend,
        "meaning": "block",
        "frame": "origin at the centre, height zero at the ground",
        "source": "test",
        "drivers": (),
        "footprint": lambda drivers: (1.0, 0.5),
        "profile": lambda x, y, drivers: 0.5 + 0 * x,
        "example": {},
        "blend": blend,
        "crowd": crowd,
    }
    return Landform(**{**options, **more})


BOWL = form(
    crowd="max",
    name="bowl",
    profile=None,
    footprint=lambda drivers: (drivers["radius"], drivers["radius"]),
    radial=Radial(
        semi_axes=lambda d: (d["radius"], d["radius"]), amplitude=lambda d: d["height"], shape=lambda r, state: np.maximum(1 - r**2, 0.0)
    ),
)


def at(landform, x=0.0, y=0.0, heading=0.0, scale=1.0, name="it"):
    """A landform placed."""
    return Placed(instance=LandformInstance(name=name, landform=landform.name, x=x, y=y, heading=heading, scale=scale), landform=landform)


def crowd(n=300, seed=1, spread=8.0):
    """Many bowls."""
    r = np.random.default_rng(seed)
    drivers = {"radius": r.uniform(0.2, 2.0, n), "height": r.uniform(-0.5, 0.5, n)}
    population = Population(
        name="many", landform="bowl", x=r.uniform(-spread, spread, n), y=r.uniform(-spread, spread, n), heading=np.zeros(n), drivers=drivers
    )
    return Crowd(population=population, landform=BOWL)


def spectral(shape, posting, hurst, median_slope, seed):
    """Ground whose spectrum is a power law up to its shortest wave and holds nothing beyond: white noise filtered by |k|^-(H + 1) on twice
    the area (Saupe 1988), scaled to a median slope [rad]. Independent of rille's own synthesis."""
    rows, columns = 2 * shape[0], 2 * shape[1]
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((rows, columns)))
    k = np.hypot(np.fft.fftfreq(rows, posting)[:, None], np.fft.rfftfreq(columns, posting)[None, :])
    k[0, 0] = np.inf
    field = np.fft.irfft2(noise * k ** -(hurst + 1.0), (rows, columns))[: shape[0], : shape[1]]
    slopes = np.abs(np.concatenate([np.diff(field, axis=0).ravel(), np.diff(field, axis=1).ravel()])) / posting
    return field * np.tan(median_slope) / np.median(slopes)
