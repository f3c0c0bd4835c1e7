"""Barchan: a crescent dune with a slip face."""

import numpy as np

from rille.terrain.landform import Driver, Landform, smooth_step

COARSE, FINE, ROUNDS = 65, 9, 5  # samples of the brink, of the bracket around the best, and how often that is narrowed
MARGIN = 0.15  # of its size, over which it fades where the ground is uneven


def _hump(x, y, drivers):
    """h cos^2(pi r / 2), r elliptical distance: parabolic near the crest (Sauermann et al. 2000), joining the ground at its foot.

    Half axes: half of the width across; the windward length upwind; downwind what puts the tips of the horns on the foot.
    """
    r = np.hypot(x / np.where(x < 0, drivers["stoss"], _downwind(drivers)), y / (drivers["width"] / 2))
    return drivers["height"] * np.where(r < 1.0, np.cos(np.pi / 2 * np.minimum(r, 1.0)) ** 2, 0.0)


def _downwind(drivers):
    """Downwind half axis [m] of the hump."""
    return drivers["horn"] / np.sqrt(1 - drivers["tips"] ** 2)


def _brink(drivers):
    """Half distance of the horns' tips [m], and c [1/m] of the brink x = c y^2."""
    tip = drivers["tips"] * drivers["width"] / 2
    return tip, drivers["horn"] / tip**2


def profile(x, y, drivers):
    """Windward of the brink the hump; in its lee the slip face: the highest of all cones at the angle of repose that stand on the brink.

    brink: parabola x = horn (y / y_tip)^2, y_tip = tips width / 2, from the crest to the horns' tips on the hump's foot. The slip face
    z = max over brink points b of z_hump(b) - tan(repose) |p - b| has the slope of repose everywhere.
    """
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    tip, curve = _brink(drivers)
    lee = x > curve * y**2
    height = np.where(lee, 0.0, _hump(x, y, drivers))
    lee &= (x < drivers["horn"] + drivers["height"] / np.tan(drivers["repose"])) & (np.abs(y) < tip)
    if lee.any():
        height[lee] = np.maximum(_slip_face(x[lee], y[lee], drivers), 0.0)
    return height


def _slip_face(x, y, drivers):
    """Height of the slip face [m]; it goes on below the ground beyond its foot."""
    slope = np.tan(drivers["repose"])
    tip, curve = _brink(drivers)

    def cone(t):
        return _hump(curve * t**2, t, drivers) - slope * np.hypot(x - curve * t**2, y - t)

    best, at = np.full(x.shape, -np.inf), np.zeros(x.shape)
    for t in np.linspace(-tip, tip, COARSE):
        z = cone(np.full(x.shape, t))
        at, best = np.where(z > best, t, at), np.maximum(z, best)
    step = 2 * tip / (COARSE - 1)
    for _ in range(ROUNDS):
        middle = at
        for shift in np.linspace(-step, step, FINE):
            t = np.clip(middle + shift, -tip, tip)
            z = cone(t)
            at, best = np.where(z > best, t, at), np.maximum(z, best)
        step *= 2 / (FINE - 1)
    return best


def _foot(drivers, samples):
    """Points (n, 2) [m] all along the foot: half of them on the hump's, from horn to horn, half on the slip face's, back again.

    Of the slip face: from each point of the brink down the steepest cone, whose direction makes cos(angle to the brink) =
    -(dz/dt) / (tan(repose) |db/dt|), the condition for the highest cone there.
    """
    half, far = drivers["width"] / 2, _downwind(drivers)
    start = np.arctan2(drivers["tips"], drivers["horn"] / far)
    around = np.linspace(start, 2 * np.pi - start, samples // 2)
    hump = np.column_stack([np.where(np.cos(around) < 0, drivers["stoss"], far) * np.cos(around), half * np.sin(around)])
    tip, curve = _brink(drivers)
    t = tip * np.cos(np.linspace(np.pi, 0.0, samples // 2))
    slope, step = np.tan(drivers["repose"]), 1e-4 * tip
    height = _hump(curve * t**2, t, drivers)
    fall = (_hump(curve * (t + step) ** 2, t + step, drivers) - _hump(curve * (t - step) ** 2, t - step, drivers)) / (2 * step)
    speed = np.hypot(2 * curve * t, 1.0)
    cosine = np.clip(-fall / (slope * speed), -1.0, 1.0)
    sine = np.sqrt(1 - cosine**2)
    x = curve * t**2 + height / slope * (cosine * 2 * curve * t + sine) / speed
    y = t + height / slope * (cosine - sine * 2 * curve * t) / speed
    return np.vstack([hump, np.column_stack([x, y])])


def _margin(drivers):
    """Distance [m] from its foot within which it fades on uneven ground."""
    return MARGIN * min(drivers["width"] / 2, drivers["stoss"])


def footprint(drivers):
    """The dune, and the margin in which it fades on uneven ground."""
    far = max(drivers["stoss"], drivers["horn"], drivers["height"] / np.tan(drivers["repose"]))
    return float(far + _margin(drivers)), float(drivers["width"] / 2 + _margin(drivers))


def weight(x, y, drivers):
    """1 on the dune, falling to 0 within the margin around its foot, so that it fills no more than the hollows right there."""
    from scipy.spatial import KDTree

    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    outside = profile(x, y, drivers) == 0
    margin = _margin(drivers)
    found = np.ones(x.shape)
    points = np.column_stack([x[outside], y[outside]])
    away, _ = KDTree(_foot(drivers, 4000)).query(points, distance_upper_bound=margin)
    found[outside] = smooth_step(1 - np.minimum(away / margin, 1.0))
    return found


def outline(drivers):
    """The foot."""
    foot = _foot(drivers, 120)
    return foot[np.abs(profile(foot[:, 0], foot[:, 1], drivers)) < 0.01 * drivers["height"]]  # not where slip faces run into each other


LANDFORM = Landform(
    name="dune",
    meaning="barchan: crescent dune with horns downwind and a slip face at the angle of repose",
    frame="origin below the crest, x downwind, height zero at the ground under it",
    source=(
        "parabolic windward side and brink: G. Sauermann et al. 2000, Geomorphology 36, 47; slip face and crescent: P. Hersen 2004, "
        "Eur. Phys. J. B 37, 507; proportions: P. A. Hesp & K. Hastings 1998, Geomorphology 22, 193; "
        "rille: squared cosine, so that the foot joins"
    ),
    drivers=(
        Driver(
            name="width",
            unit="m",
            meaning="across the wind, from side to side",
            lower=0.5,
            upper=2000.0,
            reason="smaller heaps have no slip face on Earth; tests use them all the same",
            source="rille",
        ),
        Driver(
            name="height",
            unit="m",
            meaning="of the crest",
            lower=0.02,
            upper=200.0,
            link=lambda values: 0.1 * values["width"],
            law="0.1 width",
            reason="of the largest barchans",
            source="Hesp & Hastings 1998",
        ),
        Driver(
            name="stoss",
            unit="m",
            meaning="length of the windward side, from its foot to the crest",
            lower=0.1,
            upper=5000.0,
            link=lambda values: values["height"] / np.tan(np.deg2rad(11.0)),
            law="height / tan(11 deg)",
            reason="of the largest barchans",
            source="mean slope of 11 deg: Hesp & Hastings 1998",
        ),
        Driver(
            name="horn",
            unit="m",
            meaning="how far the horns' tips lie downwind of the crest",
            lower=0.01,
            upper=4500.0,
            link=lambda values: 0.45 * values["width"],
            law="0.45 width",
            reason="shorter ones are no horns",
            source="rille: after the outlines in Hersen 2004",
        ),
        Driver(
            name="tips",
            unit="dimensionless",
            meaning="distance between the horns' tips over the width",
            lower=0.3,
            upper=0.95,
            default=0.78,
            reason="closer ones close the crescent; at 1 the dune would not end",
            source="rille: after the outlines in Hersen 2004",
        ),
        Driver(
            name="repose",
            unit="rad",
            meaning="slope of the slip face",
            lower=0.35,
            upper=0.79,
            default=np.deg2rad(34.0),
            reason="loose grains slide beyond their friction angle",
            source="25 deg (rounded grains) to 40 deg (angular): Kleinhans et al. 2011, J. Geophys. Res. 116, E11004",
        ),
    ),
    profile=profile,
    footprint=footprint,
    weight=weight,
    outline=outline,
    blend="drape",
    example={"width": 10.0},
)
