"""A comparison made by hand: three channels of two joints, white noise, and what a test adds to the first of them."""

import numpy as np

from rille.model.comparison import ComparedChannel, CompareWindow, Comparison, Regimes
from rille.model.recording import Channel

NOISE, STEP, ADVANCE = 0.01, 0.005, 1.3  # [rad], [s], [rad/s]


def made_comparison(seed, added=None, *, windows=40, samples=100, fitted=False, recording="made", noise_from="stated", rng_noise=None):
    """Windows of irregular samples. added(time, simulated, window, rng) -> what is measured beyond the noise by 'position'.

    fitted : the start of each window (offset and slope of each channel) is fitted to the measurement by least squares, as a replay does;
    ``start_gain`` is then the exact standard deviation of that fit.
    """
    rng = np.random.default_rng(seed)
    n = windows * samples
    window = np.repeat(np.arange(windows), samples)
    time = (np.arange(n) + rng.uniform(-0.3, 0.3, n)) * STEP
    channels = []
    for name, quantity, target, rate in (
        ("position", "joint.position", "shoulder", ADVANCE),
        ("other", "joint.position", "elbow", 0.7),
        ("velocity", "joint.velocity", "shoulder", ADVANCE),
    ):
        simulated = np.sin(rate * time + 1)
        noise = NOISE * rng.standard_normal(n) if rng_noise is None else rng_noise(rng, n)
        measured = simulated + noise
        if name == "position" and added is not None:
            measured = measured + added(time, simulated, window, rng)
        start = np.zeros(n)
        if fitted:
            along = np.stack([np.ones(samples), np.linspace(-1, 1, samples)], axis=1)
            hat = along @ np.linalg.inv(along.T @ along) @ along.T
            simulated = simulated + ((measured - simulated).reshape(windows, samples) @ hat).ravel()
            start = np.tile(NOISE * np.sqrt(np.diag(hat)), windows)
        unit = "rad" if quantity == "joint.position" else "rad/s"
        channels.append(
            ComparedChannel(
                channel=Channel(name=name, quantity=quantity, target=target, unit=unit),
                time=time,
                measured=measured,
                simulated=simulated,
                window=window,
                noise=NOISE,
                noise_from=noise_from,
                start_gain=start,
            )
        )
    length = samples * STEP
    return Comparison(
        recording=recording,
        model="model",
        scenario="scenario",
        mode="windows",
        channels=tuple(channels),
        windows=tuple(CompareWindow(number=k, start=k * length, stop=(k + 1) * length) for k in range(windows)),
        regimes=Regimes(
            time=time[::5],
            window=window[::5],
            values={"speed": np.abs(np.sin(0.3 * time[::5])), "joint_speed/shoulder": np.cos(ADVANCE * time[::5] + 1)},
        ),
    )
