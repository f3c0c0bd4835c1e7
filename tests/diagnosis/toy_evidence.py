"""A toy with the same questions as the real thing: two carts on springs, pushed by known forces, recorded by noisy position and speed sensors.

m_i x_i'' = -k x_i - c_0 x_i' + kappa (x_j - x_i) + u_i(t) - friction ...; windows of half a second, all of them integrated at once (RK4).
"""

from dataclasses import dataclass, replace

import numpy as np

from rille.diagnosis.evidence import ENDED
from rille.model.hypothesis import FreeNumber, Hypothesis
from rille.model.recording import Channel

STEP = 0.01
CARTS = ("left", "right")


def number(name, *, amplitude=True, lower=0.0, upper=100.0, start=0.1, spread=0.1, absent=0.0, search="local"):
    return FreeNumber(
        name=name, unit="1", amplitude=amplitude, lower=lower, upper=upper, start=start, spread=spread, absent=absent, search=search
    )


def effect(kind, target, *free, passive=False):
    return Hypothesis(cause="effect", kind=kind, target=target, target_kind="body", free=free, passive=passive)


def catalogue(targets=(*CARTS, "*")):
    """Hypotheses about the carts and their sensors."""
    found = []
    for t in targets:
        found += [
            effect("coulomb", t, number("force", spread=0.3)),
            effect("viscous", t, number("coefficient")),
            effect("quadratic", t, number("coefficient")),
            effect("stribeck", t, number("coulomb", spread=0.3), number("excess", spread=0.3),
                   number("speed", amplitude=False, lower=1e-3, upper=10, start=0.2, search="scale")),
            effect("ripple", t, number("force", spread=0.3), number("cycles", amplitude=False, lower=1, upper=60, start=6, search="order"),
                   number("phase", amplitude=False, lower=-3.15, upper=3.15, start=0.0, spread=2.0, search="phase")),
            effect("limit", t, number("inverse", upper=50.0, spread=0.05)),
            effect("lag", t, number("time", upper=5.0, spread=0.05)),
            effect("nothing", t, number("size")),
            effect("push", t, number("force", lower=-100, upper=100, spread=2.0), number("start", amplitude=False, lower=0, upper=1e3, start=0.0, spread=1.0, search="time"),
                   number("duration", amplitude=False, lower=0.01, upper=5, start=0.3, spread=0.2)),
        ]  # fmt: skip
        found.append(
            Hypothesis(
                cause="parameter",
                kind="mass",
                target=t,
                target_kind="body",
                free=(number("mass", lower=0.2, upper=5, start=1.0, absent=1.0),),
            )
        )
        found.append(
            Hypothesis(
                cause="parameter",
                kind="spring",
                target=t,
                target_kind="body",
                free=(number("spring", lower=1, upper=30, start=8.0, absent=8.0, spread=0.5),),
            )
        )
    for c in ("left position", "left speed", "right position", "right speed"):
        found.append(
            Hypothesis(
                cause="sensor", kind="bias", target=c, target_kind="channel", free=(number("offset", lower=-10, upper=10, spread=0.01),)
            )
        )
        found.append(
            Hypothesis(
                cause="sensor",
                kind="scale",
                target=c,
                target_kind="channel",
                free=(number("relative_error", lower=-2, upper=10, spread=0.05),),
            )
        )
    return found


def named(kind, target, **values):
    hypothesis = next(h for h in catalogue() if h.kind == kind and h.target == target)
    return hypothesis.at(values)


def command(t):
    """(2, ...) forces on the carts at times t."""
    return np.stack(
        [3.0 * np.sin(1.3 * t) + 2.0 * np.sin(3.1 * t + 0.02 * np.cos(t) * t), 2.5 * np.sin(0.9 * t + 1.0) + 2.0 * np.sign(np.sin(0.7 * t))]
    )


def filtered(t, lag):
    """The command behind a first-order lag, by its past over eight time constants."""
    if lag <= 1e-6:
        return command(t)
    knots = (np.arange(60) + 0.5) / 60
    ages = -lag * np.log(1 - knots)
    return np.mean([command(t - age) for age in ages], axis=0)


def motion(setting, start, begin, n_steps, extra=None):
    """(n_steps + 1, 4, W): x_left, x_right, v_left, v_right of windows that begin at times ``begin`` (W,) in ``start`` (4, W)."""
    mass, spring = np.ones((2, 1)), np.full((2, 1), 8.0)
    terms = []
    lag = np.zeros(2)
    for term in setting:
        h, values = term.hypothesis, term.numbers
        rows = [CARTS.index(h.target)] if h.target in CARTS else [0, 1]
        if h.kind == "mass":
            mass[rows] = values["mass"]
        elif h.kind == "spring":
            spring[rows] = values["spring"]
        elif h.kind == "lag":
            lag[rows] = values["time"]
        elif h.cause == "effect":
            terms.append((h.kind, rows, values))

    def push(t):
        return np.stack([filtered(t, lag[i])[i] for i in range(2)])

    def rate(t, s, u):
        x, v = s[:2], s[2:]
        u = u.copy()
        for kind, rows, values in terms:
            if kind == "limit" and values["inverse"] > 0:
                u[rows] = np.clip(u[rows], -1 / values["inverse"], 1 / values["inverse"])
        f = u - spring * x - 0.1 * v + 2.0 * (x[::-1] - x)
        for kind, rows, values in terms:
            w = v[rows]
            if kind == "coulomb":
                f[rows] -= values["force"] * np.tanh(w / 0.02)
            elif kind == "viscous":
                f[rows] -= values["coefficient"] * w
            elif kind == "quadratic":
                f[rows] -= values["coefficient"] * w * np.abs(w)
            elif kind == "stribeck":
                f[rows] -= np.tanh(w / 0.02) * (values["coulomb"] + values["excess"] * np.exp(-((w / values["speed"]) ** 2)))
            elif kind == "ripple":
                f[rows] += values["force"] * np.sin(values["cycles"] * x[rows] + values["phase"])
            elif kind == "push":
                f[rows] += values["force"] * ((t >= values["start"]) & (t < values["start"] + values["duration"]))
        if extra is not None:
            f += extra(t, x, v)
        return np.concatenate([v, f / mass])

    begin = np.asarray(begin, dtype=float)
    states = [np.array(start, dtype=float)]
    before = push(begin)
    for k in range(n_steps):
        t, s = begin + k * STEP, states[-1]
        middle, after = push(t + 0.5 * STEP), push(t + STEP)
        k1 = rate(t, s, before)
        k2 = rate(t + 0.5 * STEP, s + 0.5 * STEP * k1, middle)
        k3 = rate(t + 0.5 * STEP, s + 0.5 * STEP * k2, middle)
        k4 = rate(t + STEP, s + STEP * k3, after)
        states.append(s + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
        before = after
    return np.stack(states)


NAMES = ("left position", "right position", "left speed", "right speed")
NOISE = np.array([0.002, 0.002, 0.01, 0.01])
PRIOR = 3.0 * np.array([0.001, 0.001, 0.004, 0.004])


@dataclass(frozen=True)
class ToyEvidence:
    """Windows of a recording of the carts; residuals straight from integration, starts carried linearly."""

    measured: np.ndarray  # (W, n, 4) sensors in the order of NAMES
    begin: np.ndarray  # (W,)
    smoothed: np.ndarray  # (4, W)
    fitted: np.ndarray  # (4, W) start that residuals are run from, in standard deviations from the smoothed one
    start_gain: np.ndarray
    run: np.ndarray
    asked: list

    @property
    def channels(self):
        kinds = ("joint.position", "joint.position", "joint.velocity", "joint.velocity")
        return tuple(Channel(name=n, quantity=q, target=n.split()[0], unit="m") for n, q in zip(NAMES, kinds, strict=True))

    @property
    def shape(self):
        return self.measured.shape

    @property
    def channel(self):
        return np.broadcast_to(np.arange(4), self.shape).ravel()

    @property
    def window(self):
        return np.repeat(np.arange(self.shape[0]), self.shape[1] * 4)

    @property
    def time(self):
        return np.repeat((self.begin[:, None] + STEP * np.arange(1, self.shape[1] + 1)).ravel(), 4)

    @property
    def sigma(self):
        return np.broadcast_to(NOISE, self.shape).ravel()

    @property
    def starts(self):
        return self.begin

    @property
    def stops(self):
        return self.begin + STEP * self.shape[1]

    def run_from(self, setting, z):
        """(W, n, 4) standardised residuals with the starts z (4, W) standard deviations off the smoothed ones."""
        measured = self.measured.copy()
        for term in setting:
            if term.hypothesis.cause == "sensor":
                k = NAMES.index(term.hypothesis.target)
                values = term.numbers
                measured[..., k] = (measured[..., k] - values.get("offset", 0.0)) / (1.0 + values.get("relative_error", 0.0) + 1e-9)
        s = motion(setting, self.smoothed + PRIOR[:, None] * z, self.begin, self.shape[1])
        return (measured - s[1:].transpose(2, 0, 1)) / NOISE

    def residuals(self, settings):
        self.asked[0] += len(settings)
        found = []
        for setting in settings:
            r = self.run_from(setting, self.fitted).reshape(-1)
            moved = np.repeat(self.fitted.T, self.shape[1] * 4, axis=0)
            r = r - np.sum(self.start_gain * moved, axis=1)
            found.append(np.where(np.isfinite(r) & (np.abs(r) < 1e6), r, ENDED))
        return np.array(found)

    def relinearised(self, setting):
        z = np.zeros_like(self.fitted)
        for _ in range(2):
            gain = derivatives(self, setting, z)
            r = self.run_from(setting, z).reshape(self.shape[0], -1)
            d = gain.reshape(self.shape[0], -1, 4)
            r = r - np.einsum("wnk,kw->wn", d, z)
            z = -np.stack([np.linalg.solve(np.eye(4) + a.T @ a, a.T @ b) for a, b in zip(d, r, strict=True)], axis=1)
        return replace(self, fitted=z, start_gain=derivatives(self, setting, z))

    def subset(self, windows):
        rows = np.isin(self.window, windows)
        return replace(self, measured=self.measured[windows], begin=self.begin[windows], smoothed=self.smoothed[:, windows],
                       fitted=self.fitted[:, windows], start_gain=self.start_gain[rows], run=self.run[windows])  # fmt: skip


def derivatives(evidence, setting, z):
    """(N, 4) of the residuals by z."""
    base = evidence.run_from(setting, z)
    return np.stack([(evidence.run_from(setting, z + 1e-3 * np.eye(4)[:, k : k + 1]) - base).ravel() / 1e-3 for k in range(4)], axis=1)


def recorded(truth=(), *, seconds=30.0, window=0.5, seed=0, extra=None, noise=1.0, runs=1):
    """Evidence from a machine on which ``truth`` is at work (and ``extra``(t, x, v), which no hypothesis knows)."""
    rng = np.random.default_rng(seed)
    n = round(window / STEP)
    pieces, begins, smoothed, run = [], [], [], []
    for r in range(runs):
        first = 100.0 * r
        path = motion(truth, rng.normal(0, [0.2, 0.2, 0.3, 0.3])[:, None], [first], round(seconds / STEP), extra)[:, :, 0]
        seen = path + NOISE * noise * rng.normal(size=path.shape)
        for term in truth:
            if term.hypothesis.cause == "sensor":
                k = NAMES.index(term.hypothesis.target)
                seen[:, k] = seen[:, k] * (1 + term.numbers.get("relative_error", 0.0)) + term.numbers.get("offset", 0.0)
        for w in range(int(seconds / window)):
            pieces.append(seen[w * n + 1 : (w + 1) * n + 1])
            begins.append(first + w * window)
            shift = seen[w * n] - path[w * n] - NOISE * noise * 0
            smoothed.append(path[w * n] + 0.3 * PRIOR * rng.normal(size=4) + np.round(shift * 0, 1))
            run.append(r)
    w = len(pieces)
    blank = ToyEvidence(measured=np.array(pieces), begin=np.array(begins), smoothed=np.array(smoothed).T, fitted=np.zeros((4, w)),
                        start_gain=np.zeros((w * n * 4, 4)), run=np.array(run), asked=[0])  # fmt: skip
    return replace(blank, start_gain=derivatives(blank, (), blank.fitted))
