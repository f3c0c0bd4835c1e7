"""A toy with the same questions as the real thing: two carts on springs, pushed by known forces, with noisy position and speed sensors.

m_i x_i'' = -k x_i - c_0 x_i' + kappa (x_j - x_i) + u_i(t) - friction ...; windows of half a second, all of them integrated at once
(semi-implicit Euler, in the truth as in the models).
"""

from dataclasses import dataclass, replace

import numpy as np

from rille.diagnosis.evidence.evidence import ENDED
from rille.model.hypothesis import FreeNumber, Hypothesis
from rille.model.recording import Channel

STEP = 0.02
CARTS = ("left", "right")
NAMES = ("left position", "right position", "left speed", "right speed")
NOISE = np.array([0.002, 0.002, 0.01, 0.01])
PRIOR = 3.0 * np.array([0.001, 0.001, 0.004, 0.004])
ALIASES = {"dashpot": "viscous", "viscous_number": "viscous"}  # other words for the same thing


def number(name, *, amplitude=True, lower=0.0, upper=100.0, start=0.1, spread=0.1, absent=0.0, search="local"):
    return FreeNumber(
        name=name, unit="1", amplitude=amplitude, lower=lower, upper=upper, start=start, spread=spread, absent=absent, search=search
    )


def shape(name, start, lower, upper, search="local", spread=1.0):
    return number(name, amplitude=False, lower=lower, upper=upper, start=start, spread=spread, search=search)


def effect(kind, target, *free):
    return Hypothesis(cause="effect", kind=kind, target=target, target_kind="body", free=free)


def parameter(kind, target, value, spread):
    free = (number(kind, lower=0.1 * value, upper=5 * value, start=value, absent=value, spread=spread),)
    return Hypothesis(cause="parameter", kind=kind, target=target, target_kind="body", free=free)


def fault(kind, target, name, spread):
    free = (number(name, lower=-2, upper=10, spread=spread),)
    return Hypothesis(cause="sensor", kind=kind, target=target, target_kind="channel", free=free)


def catalogue(targets=(*CARTS, "*")):
    """Hypotheses about the carts and their sensors."""
    found = []
    for t in targets:
        force, either = number("force", spread=0.3), number("force", lower=-100, upper=100, spread=2.0)
        found += [
            effect("coulomb", t, force),
            effect("viscous", t, number("coefficient")),
            effect("quadratic", t, number("coefficient")),
            effect("stribeck", t, number("coulomb", spread=0.3), number("excess", spread=0.3), shape("speed", 0.2, 1e-3, 10, "scale")),
            effect("ripple", t, force, shape("cycles", 6, 1, 60, "order"), shape("phase", 0.0, -3.15, 3.15, "phase")),
            effect("limit", t, number("inverse", upper=50.0, spread=0.05)),
            effect("lag", t, number("time", upper=5.0, spread=0.05)),
            effect("nothing", t, number("size")),
            effect("push", t, either, shape("start", 0.0, 0, 1e3, "time"), shape("duration", 0.3, 0.01, 5, spread=0.2)),
            parameter("mass", t, 1.0, 0.1),
            parameter("spring", t, 8.0, 0.5),
        ]
    for name in NAMES:
        found += [fault("bias", name, "offset", 0.01), fault("scale", name, "relative_error", 0.05)]
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
    """The command behind a first-order lag, by its past over some time constants."""
    if lag <= 1e-6:
        return command(t)
    ages = -lag * np.log(1 - (np.arange(30) + 0.5) / 30)
    return np.mean(command(t - ages.reshape(-1, *[1] * np.ndim(t))), axis=1)


def numbers_of(settings):
    """{(kind, how often before): {name: (2, k, 1)}} of effects; masses, springs, lags (2, k, 1)."""
    k = len(settings)
    found, base = {}, {"mass": np.ones((2, k, 1)), "spring": np.full((2, k, 1), 8.0), "lag": np.zeros((2, k, 1))}
    for i, setting in enumerate(settings):
        seen = []
        for term in setting:
            h = term.hypothesis
            kind = ALIASES.get(h.kind, h.kind)
            rows = [CARTS.index(h.target)] if h.target in CARTS else [0, 1]
            if kind in base:
                base[kind][rows, i] = next(iter(term.numbers.values()))
            elif h.cause != "sensor":
                key = (kind, seen.count(kind))
                seen.append(kind)
                for name, value in term.numbers.items():
                    found.setdefault(key, {}).setdefault(name, np.zeros((2, k, 1)))[rows, i] = value
    return found, base["mass"], base["spring"], base["lag"]


def motion(settings, start, begin, n_steps, extra=None):
    """(n_steps + 1, 4, k, W): x_left, x_right, v_left, v_right of k settings; windows begin at ``begin`` (W,) in ``start`` (4, W)."""
    terms, mass, spring, lag = numbers_of(settings)

    def push(t):
        u = np.repeat(command(t)[:, None], len(settings), axis=1)
        for cart, i in zip(*np.nonzero(lag[..., 0] > 0), strict=True):
            u[cart, i] = filtered(t, lag[cart, i, 0])[cart]
        return u

    def acceleration(t, x, v, u):
        for (kind, _), n in terms.items():
            if kind == "limit":
                most = 1 / np.maximum(n["inverse"], 1e-6)
                u = np.clip(u, -most, most)
        f = u - spring * x - 0.1 * v + 2.0 * (x[::-1] - x)
        for (kind, _), n in terms.items():
            if kind == "coulomb":
                f -= n["force"] * np.tanh(v / 0.02)
            elif kind == "viscous":
                f -= n["coefficient"] * v
            elif kind == "quadratic":
                f -= n["coefficient"] * v * np.abs(v)
            elif kind == "stribeck":
                f -= np.tanh(v / 0.02) * (n["coulomb"] + n["excess"] * np.exp(-((v / np.maximum(n["speed"], 1e-9)) ** 2)))
            elif kind == "ripple":
                f += n["force"] * np.sin(n["cycles"] * x + n["phase"])
            elif kind == "push":
                f += n["force"] * ((t >= n["start"]) & (t < n["start"] + n["duration"]))
        if extra is not None:
            f += extra(t, x, v)
        return f / mass

    begin = np.asarray(begin, dtype=float)
    start = np.repeat(np.asarray(start, dtype=float)[:, None], len(settings), axis=1)
    states = np.empty((n_steps + 1, *start.shape))
    states[0] = start
    for step in range(n_steps):
        t, x, v = begin + step * STEP, states[step, :2], states[step, 2:]
        states[step + 1, 2:] = v + STEP * acceleration(t, x, v, push(t + 0.5 * STEP))
        states[step + 1, :2] = x + STEP * states[step + 1, 2:]
    return states


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

    def run_from(self, settings, z):
        """(k, W, n, 4) standardised residuals with the starts z (4, W) standard deviations off the smoothed ones."""
        states = motion(settings, self.smoothed + PRIOR[:, None] * z, self.begin, self.shape[1])
        measured = np.repeat(self.measured[None], len(settings), axis=0)
        for i, setting in enumerate(settings):
            for term in setting:
                if term.hypothesis.cause == "sensor":
                    k, values = NAMES.index(term.hypothesis.target), term.numbers
                    measured[i, ..., k] = (measured[i, ..., k] - values.get("offset", 0.0)) / (
                        1.0 + values.get("relative_error", 0.0) + 1e-9
                    )
        return (measured - states[1:].transpose(2, 3, 0, 1)) / NOISE

    def residuals(self, settings):
        self.asked[0] += len(settings)
        with np.errstate(all="ignore"):
            r = self.run_from(settings, self.fitted).reshape(len(settings), -1)
        r = r - np.sum(self.start_gain * np.repeat(self.fitted.T, self.shape[1] * 4, axis=0), axis=1)
        return np.where(np.isfinite(r) & (np.abs(r) < 1e6), r, ENDED)

    def relinearised(self, setting):
        z = np.zeros_like(self.fitted)
        for _ in range(2):
            gain = derivatives(self, setting, z)
            r = self.run_from([setting], z).reshape(self.shape[0], -1)
            d = gain.reshape(self.shape[0], -1, 4)
            r = r - np.einsum("wnk,kw->wn", d, z)
            z = -np.stack([np.linalg.solve(np.eye(4) + a.T @ a, a.T @ b) for a, b in zip(d, r, strict=True)], axis=1)
        return replace(self, fitted=z, start_gain=derivatives(self, setting, z))

    def subset(self, windows, *, roughly=False):
        rows = np.isin(self.window, windows)
        return replace(self, measured=self.measured[windows], begin=self.begin[windows], smoothed=self.smoothed[:, windows],
                       fitted=self.fitted[:, windows], start_gain=self.start_gain[rows], run=self.run[windows])  # fmt: skip


def derivatives(evidence, setting, z):
    """(N, 4) of the residuals by z."""
    base = evidence.run_from([setting], z)
    return np.stack([(evidence.run_from([setting], z + 1e-3 * np.eye(4)[:, k : k + 1]) - base).ravel() / 1e-3 for k in range(4)], axis=1)


def recorded(truth=(), *, seconds=30.0, window=0.5, seed=0, extra=None, noise=1.0, runs=1):
    """Evidence from a machine on which ``truth`` is at work (and ``extra``(t, x, v), which no hypothesis knows)."""
    rng = np.random.default_rng(seed)
    n = round(window / STEP)
    pieces, begins, smoothed, run = [], [], [], []
    for r in range(runs):
        first = 100.0 * r
        path = motion([truth], rng.normal(0, [0.2, 0.2, 0.3, 0.3])[:, None], [first], round(seconds / STEP), extra)[:, :, 0, 0]
        seen = path + NOISE * noise * rng.normal(size=path.shape)
        for term in truth:
            if term.hypothesis.cause == "sensor":
                k = NAMES.index(term.hypothesis.target)
                seen[:, k] = seen[:, k] * (1 + term.numbers.get("relative_error", 0.0)) + term.numbers.get("offset", 0.0)
        for w in range(int(seconds / window)):
            pieces.append(seen[w * n + 1 : (w + 1) * n + 1])
            begins.append(first + w * window)
            smoothed.append(path[w * n] + 0.3 * PRIOR * rng.normal(size=4))
            run.append(r)
    w = len(pieces)
    blank = ToyEvidence(measured=np.array(pieces), begin=np.array(begins), smoothed=np.array(smoothed).T, fitted=np.zeros((4, w)),
                        start_gain=np.zeros((w * n * 4, 4)), run=np.array(run), asked=[0])  # fmt: skip
    return replace(blank, start_gain=derivatives(blank, (), blank.fitted))
