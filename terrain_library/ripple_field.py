"""Field of wind ripples."""

import numpy as np

from rille.terrain.landform import Driver, Landform, smooth_step
from rille.terrain.relief import ends

WAVES = 10  # plane waves that bend the crests
FAINT = 0.5  # modulus below which ripples fade out


def _pattern(x, y, drivers):
    """Phase (0 at a crest, 1 at the next) and strength (0..1) of the ripples: those of exp(2 pi i (x / wavelength + d)) (1 + waviness g).

    g is a complex random field of rms 1, a sum of plane waves longer than four wavelengths; d is a real one of rms waviness / 2 and
    twice that length. They swerve the crests, and where 1 + waviness g passes through 0 a crest ends in a fork, as in real fields;
    ripples fade there, so the surface stays smooth.
    """
    wavelength = drivers["wavelength"]
    t = np.broadcast_to(x / wavelength, np.broadcast(x, y).shape)
    if drivers["waviness"] == 0:
        return t - np.floor(t), np.ones(t.shape)
    random = np.random.default_rng(int(drivers["seed"]))
    kx, ky = 2 * np.pi / (4 * wavelength) * random.uniform(-1.0, 1.0, (2, WAVES))
    start = random.uniform(0.0, 2 * np.pi, WAVES)
    real, imaginary, shift = np.ones(t.shape), np.zeros(t.shape), np.zeros(t.shape)
    share = drivers["waviness"] / np.sqrt(WAVES)
    for k in range(WAVES):
        phase = kx[k] * x + ky[k] * y + start[k]
        real += share * np.cos(phase)
        imaginary += share * np.sin(phase)
        shift += share / np.sqrt(2) * np.cos(phase / 2)
    t = t + shift + np.arctan2(imaginary, real) / (2 * np.pi)
    return t - np.floor(t), smooth_step(np.hypot(real, imaginary) / FAINT)


def profile(x, y, drivers):
    """Half cosines about the mean level: from crest down to trough over ``lee`` wavelengths, then up to the next crest over the rest.

    Steepest lee pi h / (2 lee wavelength) where crests are straight.
    """
    lee, fade = drivers["lee"], drivers["fade"]
    t, strength = _pattern(x, y, drivers)
    wave = np.where(t < lee, np.cos(np.pi * t / lee), -np.cos(np.pi * (t - lee) / (1 - lee)))
    return drivers["height"] / 2 * strength * wave * ends(x, drivers["length"] / 2, fade) * ends(y, drivers["width"] / 2, fade)


LANDFORM = Landform(
    name="ripple_field",
    meaning="asymmetric wind ripples over a rectangular field whose borders fade",
    frame="origin in the middle of the field, x downwind, height zero at the mean level between troughs and crests",
    source="rille: half cosines; proportions of S. A. Wilson 2014, Encyclopedia of Planetary Landforms, 'Aeolian ripple'",
    drivers=(
        Driver(
            name="length",
            unit="m",
            meaning="of the field, downwind",
            lower=0.05,
            upper=10000.0,
            reason="a few ripples at least",
            source="rille",
        ),
        Driver(
            name="width",
            unit="m",
            meaning="of the field, along the crests",
            lower=0.05,
            upper=10000.0,
            reason="a few ripples at least",
            source="rille",
        ),
        Driver(
            name="wavelength",
            unit="m",
            meaning="crest to crest",
            lower=0.01,
            upper=50.0,
            reason="ripples have 0.01 to 20 m, larger ones on Mars",
            source="Leeder 1982, as quoted by Wilson 2014",
        ),
        Driver(
            name="height",
            unit="m",
            meaning="trough to crest",
            lower=0.0005,
            upper=5.0,
            link=lambda values: max(values["wavelength"] / 15.0, 0.0005),
            law="wavelength / 15",
            reason="a few grains at least",
            source="index 15, of 12 to 50: Leeder 1982, as quoted by Wilson 2014",
        ),
        Driver(
            name="lee",
            unit="dimensionless",
            meaning="share of the wavelength that the lee side takes; 0.5: symmetric",
            lower=0.1,
            upper=0.5,
            default=0.3,
            reason="ripples have no slip face",
            source="rille: a lee of 19 deg and an upwind side of 9 deg at index 15",
        ),
        Driver(
            name="waviness",
            unit="dimensionless",
            meaning="how much crests swerve and fork; 0: straight, a test track",
            lower=0.0,
            upper=1.0,
            default=0.55,
            reason="at 1 there are forks everywhere",
            source="rille",
        ),
        Driver(
            name="seed",
            unit="dimensionless",
            meaning="of the crests' bends",
            lower=0.0,
            upper=4294967295.0,
            default=1.0,
            reason="a 32-bit number",
            source="rille",
        ),
        Driver(
            name="fade",
            unit="m",
            meaning="distance over which the field's borders fade, at most half of it",
            lower=0.005,
            upper=5000.0,
            link=lambda values: min(3 * values["wavelength"], values["length"] / 4, values["width"] / 4),
            law="3 wavelengths, at most a quarter of the field",
            reason="half of the largest field",
            source="rille",
        ),
    ),
    profile=profile,
    footprint=lambda drivers: (drivers["length"] / 2, drivers["width"] / 2),
    example={"length": 12.0, "width": 9.0, "wavelength": 0.6},
)
