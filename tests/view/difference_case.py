"""A made-up rover traverse with known differences, for the report: nothing simulated, seeded."""

import numpy as np

from rille.model.comparison import ComparedChannel, CompareWindow, Comparison, Regimes
from rille.model.recording import Channel

CENTRE = (0.0, 0.0)


def comparison(
    name: str = "traverse/1", *, seconds: float = 40.0, rate: float = 50.0, window: float = 0.5, seed: int = 1, faulty: bool = True
) -> Comparison:
    """A rover's curve: ``wheel_front_left`` is faster than simulated from 24 s to 28 s, its torque grows with slip, yaw is late.

    All else is white noise of the stated size; without ``faulty`` everything is.
    """
    chance = np.random.default_rng(seed)
    time = np.arange(0.0, seconds, 1 / rate) + chance.normal(0, 0.1 / rate, round(seconds * rate))
    number = np.clip((time // window).astype(np.int64), 0, None)
    heading = 0.25 * np.sin(0.2 * time)
    speed = 0.12 + 0.04 * np.sin(0.5 * time)
    step = np.gradient(time)
    x, y = np.cumsum(speed * np.cos(heading) * step), np.cumsum(speed * np.sin(heading) * step)
    slip = 0.1 + 0.08 * np.sin(0.7 * time) + 0.1 * (time > 24)

    def channel(name, quantity, target, unit, simulated, noise, fault=0.0, component="", left_out=""):
        described = Channel(name=name, quantity=quantity, target=target, unit=unit, component=component, noise=noise)
        measured = simulated + noise * chance.standard_normal(len(time)) + (fault if faulty else 0.0)
        measured[200:205] = np.nan
        return ComparedChannel(
            channel=described, time=time, measured=measured, simulated=simulated, window=number, noise=noise, left_out=left_out
        )

    late = 0.25 * np.sin(0.2 * (time - 0.12)) - heading
    turning = speed / 0.15
    channels = [
        channel("x", "part.position", "chassis", "m", x, 0.004, component="x"),
        channel("y", "part.position", "chassis", "m", y, 0.004, component="y"),
        channel("yaw", "part.orientation", "chassis", "rad", heading, 0.004, late, component="yaw"),
        channel("imu_yaw", "part.orientation", "chassis", "rad", heading, 0.01, 0.5, component="yaw", left_out="bad channel"),
    ]
    for wheel in ("front_left", "middle_left", "rear_left", "front_right", "middle_right", "rear_right"):
        hit = 0.09 * ((time > 24) & (time < 28)) if wheel == "front_left" else 0.0
        channels.append(channel(f"{wheel}_speed", "joint.velocity", f"wheel_{wheel}", "rad/s", turning, 0.02, hit))
    channels.append(
        channel("front_left_torque", "wheel.drive_torque", "wheel_front_left", "N m", 2 + 4 * slip, 0.1, 3.0 * np.maximum(0, slip - 0.15))
    )
    every = slice(None, None, 5)
    regimes = Regimes(
        time=time[every],
        window=number[every],
        values={
            "speed": speed[every],
            "turning_rate": 0.05 * np.cos(0.2 * time[every]),
            "slope": 0.1 * np.sin(0.3 * x[every]),
            "x": CENTRE[0] + x[every],
            "y": CENTRE[1] + y[every],
            "slip_ratio/wheel_front_left": slip[every],
            "normal_load/wheel_front_left": 60 + 5 * np.sin(time[every]),
        },
    )
    windows = tuple(
        CompareWindow(number=int(k), start=float(k * window), stop=float((k + 1) * window), shift=float(abs(chance.normal())))
        for k in np.unique(number)
    )
    return Comparison(
        recording=name,
        model="rover.db",
        scenario="traverse",
        mode="windows",
        channels=tuple(channels),
        windows=windows,
        regimes=regimes,
        notes=("the drive of the masts has no command channel; the scenario's own command is kept",),
    )
