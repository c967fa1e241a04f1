"""Simulated input/output sets with one nonlinearity each, and linear ones, for judging the default choice."""

from collections.abc import Callable, Mapping

import numpy as np

from benchmarks.identification.identification_sets_data import PublicSet
from estimation.arrays import Array
from estimation.identification.model.recursion import filtered

TRAIN, TEST = 1200, 800
"""Number of samples for fitting and for testing."""

NOISE = 0.03
"""Standard deviation of the sensor's noise relative to that of the output."""


def simulated_sets(seed: int = 0) -> list[PublicSet]:
    """Return one set for each plant, with noise and input drawn from a seed.

    Parameters
    ----------
    seed : int
        Seed of everything random.
    """
    return [_set(name, make, seed) for name, make in PLANTS.items()]


def _set(name: str, make: Callable[[Array, np.random.Generator], Array], seed: int) -> PublicSet:
    rng = np.random.default_rng([seed, list(PLANTS).index(name)])
    hold = int(rng.integers(3, 15))
    u = 1.0 + 2.0 * np.repeat(rng.normal(size=(TRAIN + TEST) // hold + 1), hold)[: TRAIN + TEST]
    y = 10.0 + make(u, rng)
    y = y + NOISE * y[:TRAIN].std() * rng.normal(size=y.size)
    train, test = slice(0, TRAIN), slice(TRAIN, None)
    return PublicSet(name, name not in LINEAR, 0.01, (u[train, None], y[train]), {"": (u[test, None], y[test])}, 5)


def _second(u: Array) -> Array:
    return filtered([0.0, 0.0, 0.1, 0.05], [1.0, -1.6, 0.75], u)


def _linear(u: Array, _: np.random.Generator) -> Array:
    return _second(u)


def _coloured(u: Array, rng: np.random.Generator) -> Array:
    y = _second(u)
    drift = filtered([1.0], [1.0, -0.97], rng.normal(size=u.size))
    return y + 0.15 * y.std() / drift.std() * drift


def _drift(u: Array, rng: np.random.Generator) -> Array:
    y = _second(u)
    walk = np.cumsum(rng.normal(size=u.size))
    return y + 0.15 * y.std() / walk.std() * walk


def _slow(u: Array, _: np.random.Generator) -> Array:
    return filtered([0.0, 0.02], [1.0, -0.98], u) + filtered([0.0, 0.3], [1.0, -0.6], u)


def _dead_zone(u: Array, _: np.random.Generator) -> Array:
    return _second(np.where(u > 1.0, u - 1.0, np.where(u < -1.5, u + 1.5, 0.0)))


def _saturation(u: Array, _: np.random.Generator) -> Array:
    return _second(np.clip(u, -1.5, 2.0))


def _backlash(u: Array, _: np.random.Generator) -> Array:
    moved, width = np.zeros(u.size), 1.0
    for t in range(1, u.size):
        moved[t] = min(max(moved[t - 1], u[t] - width), u[t] + width)
    return _second(moved)


def _friction(u: Array, _: np.random.Generator) -> Array:
    """Return the speed of a drive with Coulomb and viscous friction."""
    v, out, step = 0.0, np.zeros(u.size), 0.01
    for t in range(u.size):
        out[t] = v
        for _step in range(10):
            free = v + 0.1 * step * (40.0 * (u[t] - 1.0) - 4.0 * v)
            rub = 0.1 * step * 25.0
            v = 0.0 if abs(free) <= rub else free - rub * np.sign(free)
    return out


def _position(u: Array, rng: np.random.Generator) -> Array:
    return 0.01 * np.cumsum(_friction(u, rng))


def _valve(u: Array, _: np.random.Generator) -> Array:
    """Return a pressure behind a valve whose flow is proportional to the square root of the pressure drop."""
    p, out = 0.0, np.zeros(u.size)
    for t in range(u.size):
        out[t] = p
        drop = 6.0 * np.tanh(0.4 * u[t]) - p
        p += 0.08 * np.sign(drop) * np.sqrt(abs(drop))
    return out


def _bilinear(u: Array, _: np.random.Generator) -> Array:
    y = np.zeros(u.size)
    for t in range(1, u.size):
        y[t] = 0.85 * y[t - 1] + 0.1 * u[t - 1] - 0.03 * np.clip(u[t - 1], -4, 4) * y[t - 1]
    return y


def _wiener(u: Array, _: np.random.Generator) -> Array:
    return np.tanh(0.6 * _second(u))


def _hysteretic(u: Array, _: np.random.Generator) -> Array:
    """Return the force of a damper: viscous, plus a saturating hysteretic part."""
    z, out = 0.0, np.zeros(u.size)
    smooth = filtered([0.1], [1.0, -0.9], u)
    for t in range(u.size):
        z += 0.3 * (smooth[t] - 0.7 * abs(smooth[t]) * z)
        out[t] = 0.3 * smooth[t] + z
    return out


LINEAR = ("linear", "coloured noise", "drift", "two time constants")

PLANTS: Mapping[str, Callable[[Array, np.random.Generator], Array]] = {
    "linear": _linear,
    "coloured noise": _coloured,
    "drift": _drift,
    "two time constants": _slow,
    "dead zone": _dead_zone,
    "saturation": _saturation,
    "backlash": _backlash,
    "friction": _friction,
    "friction, position": _position,
    "valve": _valve,
    "bilinear": _bilinear,
    "saturated sensor": _wiener,
    "hysteretic damper": _hysteretic,
}
"""Output of each plant."""
