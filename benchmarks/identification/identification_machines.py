"""Simulated machines and circuits with train and test records, for judging defaults on unfamiliar logs."""

from collections.abc import Callable, Mapping

import numpy as np

from benchmarks.identification.identification_sets_data import PublicSet
from estimation.arrays import Array
from estimation.identification.model.recursion import filtered

SIZES = {"train": (600, 2500), "test": (400, 1200)}
"""Number of samples, from and to."""

STEPS_PER_SAMPLE = 10
"""Simulation steps in one sample."""

NOISE = (0.003, 0.03)
"""Standard deviation of the sensor's noise relative to that of the output, from and to."""


def machine_sets(seed: int = 0) -> list[PublicSet]:
    """Return one set for each machine, all drawn from a seed; no set if Euler's method fails.

    Parameters
    ----------
    seed : int
        Seed of everything random.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        made = [_set(name, make, seed) for name, make in MACHINES.items()]
    return [one for one in made if all(np.isfinite(y).all() for _, y in (one.train, *one.tests.values()))]


def _set(name: str, make: Callable[[Array, np.random.Generator], Array], seed: int) -> PublicSet:
    rng = np.random.default_rng([seed, 1000 + list(MACHINES).index(name)])
    train, test = (int(rng.integers(*SIZES[one])) for one in ("train", "test"))
    u = _input(train + test, rng)
    y = make(u, rng)
    y = y + rng.uniform(*NOISE) * y[:train].std() * rng.normal(size=y.size) + rng.normal()
    first, last = slice(0, train), slice(train, None)
    return PublicSet(name, True, 0.01, (u[first, None], y[first]), {"": (u[last, None], y[last])}, 5)


def _input(n: int, rng: np.random.Generator) -> Array:
    """Return random steps, low-passed noise, or a multisine, with unit standard deviation about a level of its own."""
    kind = rng.integers(3)
    if kind == 0:
        hold = int(rng.integers(5, 40))
        u = np.repeat(rng.uniform(-1.7, 1.7, n // hold + 1), hold)[:n]
    elif kind == 1:
        pole = float(rng.uniform(0.7, 0.97))
        u = filtered([1.0 - pole], [1.0, -pole], rng.normal(size=n))
    else:
        lines = np.arange(1, int(rng.integers(20, 120)))
        phases = rng.uniform(0.0, 2.0 * np.pi, lines.size)
        u = np.cos(2.0 * np.pi * np.outer(np.arange(n) / 1024.0, lines) + phases).sum(axis=1)
    return (u - u.mean()) / u.std() + float(rng.choice([0.0, 0.5]))


def _euler_output(
    u: Array, state: Array, slope: Callable[[Array, float], Array], output: Callable[[Array], float]
) -> Array:
    """Return the measured output of a state integrated by Euler steps, with the input held over each sample."""
    out = np.zeros(u.size)
    for t, value in enumerate(u):
        out[t] = output(state)
        for _ in range(STEPS_PER_SAMPLE):
            state = state + slope(state, float(value)) / STEPS_PER_SAMPLE
    return out


def _damper(u: Array, rng: np.random.Generator) -> Array:
    """Return the force of a controllable damper against speed: it saturates, lags and has some stiffness."""
    yielding, lag, stiff = rng.uniform(0.8, 2.0), rng.uniform(0.1, 0.5), rng.uniform(0.0, 0.05)

    def slope(x: Array, v: float) -> Array:
        return np.array([lag * (v - 0.8 * abs(v) * x[0]), v - 0.02 * x[1], v - x[2]])

    return _euler_output(u, np.zeros(3), slope, lambda x: yielding * np.tanh(2.0 * x[0]) + stiff * x[1] + 0.3 * x[2])


def _crane(u: Array, rng: np.random.Generator) -> Array:
    """Return the pressure of a crane's cylinder behind a valve with a dead zone; the load swings on the oil."""
    dead, stiff, damp = rng.uniform(0.0, 0.4), rng.uniform(0.05, 0.3), rng.uniform(0.03, 0.15)

    def slope(x: Array, v: float) -> Array:
        opened = np.sign(v) * max(abs(v) - dead, 0.0)
        flow = 0.4 * opened * np.sqrt(max(4.0 - np.sign(opened) * x[0], 0.0))
        return np.array([stiff * (flow - x[1]) * 3.0 - 0.02 * x[0], 0.3 * (x[0] - 0.05 * x[2]) - damp * x[1], x[1]])

    return _euler_output(u, np.zeros(3), slope, lambda x: float(x[0]))


def _cylinder(u: Array, rng: np.random.Generator) -> Array:
    """Return the position of a pneumatic cylinder with a spring and static friction."""
    rub, spring, fill = rng.uniform(0.1, 0.5), rng.uniform(0.0, 0.05), rng.uniform(0.05, 0.3)

    def slope(x: Array, v: float) -> Array:
        push = x[0] - spring * x[2]
        force = push - np.tanh(x[1] / 0.02) * rub - 0.3 * x[1]
        drop = 2.0 * np.tanh(v) - x[0]
        return np.array([fill * np.sign(drop) * np.sqrt(abs(drop)) - 0.2 * x[1], 0.2 * force, x[1]])

    return _euler_output(u, np.zeros(3), slope, lambda x: float(x[2]))


def _drive(u: Array, rng: np.random.Generator) -> Array:
    """Return the speed of two pulleys joined by a belt, from a sensor with or without sign."""
    rub, belt, blind = rng.uniform(0.0, 0.4), rng.uniform(0.05, 0.3), bool(rng.integers(2))

    def slope(x: Array, v: float) -> Array:
        pull = belt * x[2] + 0.05 * (x[0] - x[1])
        rubbed = rub * np.tanh(x[0] / 0.05)
        return np.array([0.2 * (v - rubbed - 0.3 * x[0]) - pull, pull - 0.05 * x[1], x[0] - x[1]])

    return _euler_output(u, np.zeros(3), slope, lambda x: abs(float(x[1])) if blind else float(x[1]))


def _position(u: Array, rng: np.random.Generator) -> Array:
    """Return the angle of a motor with friction and no restoring torque."""
    rub, damp = rng.uniform(0.1, 0.6), rng.uniform(0.05, 0.3)

    def slope(x: Array, v: float) -> Array:
        return np.array([0.3 * (v - rub * np.tanh(x[0] / 0.05)) - damp * x[0], x[0]])

    return _euler_output(u, np.zeros(2), slope, lambda x: float(x[1]))


def _circuit(u: Array, rng: np.random.Generator) -> Array:
    """Return the voltage of a resonant circuit with a stiffening capacitor or a diode load."""
    hard, damp, diode = rng.uniform(0.0, 0.5), rng.uniform(0.05, 0.4), rng.uniform(0.0, 0.5) * rng.integers(2)

    def slope(x: Array, v: float) -> Array:
        loss = diode * max(x[0] - 0.6, 0.0)
        return np.array([x[1] - loss, 0.3 * (v - x[0] - hard * x[0] ** 3) - damp * x[1]])

    return _euler_output(u, np.zeros(2), slope, lambda x: float(x[0]))


def _tank(u: Array, rng: np.random.Generator) -> Array:
    """Return the level of the lower of two tanks; the upper one may overflow."""
    hole, rim = rng.uniform(0.03, 0.1), rng.uniform(2.0, 6.0)

    def slope(x: Array, v: float) -> Array:
        out, through = (hole * np.sqrt(max(level, 0.0)) for level in x)
        over = max(x[0] - rim, 0.0)
        return np.array([0.05 * max(v + 1.5, 0.0) - out - over, out + 0.3 * over - through])

    return _euler_output(u, np.ones(2), slope, lambda x: float(x[1]))


MACHINES: Mapping[str, Callable[[Array, np.random.Generator], Array]] = {
    "controllable damper": _damper,
    "crane pressure": _crane,
    "pneumatic cylinder": _cylinder,
    "belt drive": _drive,
    "motor angle": _position,
    "circuit": _circuit,
    "two tanks": _tank,
}
"""Measured output of each machine."""
