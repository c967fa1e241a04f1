"""Stand-ins for held-back sets: machines simulated from their equations, with the last two fifths as the test.

Outputs of one machine share a run. Values, sizes and noise are drawn from a seed. One test says little about a
nonlinear machine, so other records are made on demand: other inputs of the same kind from rest, with the same last two
fifths as tests.
"""

from collections.abc import Callable, Mapping
from copy import deepcopy
from math import copysign, cos, exp, sin, sqrt, tanh

import numpy as np

from benchmarks.identification.identification_sets_data import Part, PublicSet
from estimation.arrays import Array
from estimation.identification.model.recursion import filtered

SIZES = (420, 2000)
"""Number of samples of a log, from and to."""

TRAINING_SHARE = 0.6
"""Share of a log for fitting."""

NOISE = (0.004, 0.01)
"""Standard deviation of the sensor's noise relative to that of the output, from and to."""

SKIPPED_SAMPLES = 5
"""Samples at the start of a test that are excluded."""

ATMOSPHERE, SUPPLY = 1.0, 6.0
"""Ambient and supply pressure of a pneumatic cylinder [bar]."""

CRITICAL_PRESSURE_RATIO = 0.528
"""Critical pressure ratio, below which air flow is choked [dimensionless]."""

CELLS = 8
"""Number of cells on each side of the heat exchanger."""

Outputs = dict[str, Array]
"""Measured signals by name, shape (n,)."""

Drive = Callable[[np.random.Generator], Array]
"""Draws one input of a kind, shape (n,)."""

OTHER_RECORDS_SEED = 78
"""Seed part that separates the draws of other records from all other draws."""


def stand_in_sets(seed: int = 0, again: int = 0) -> list[PublicSet]:
    """Return one set for each output of every stand-in.

    Parameters
    ----------
    seed : int
        Seed of everything random.
    again : int
        Number of other records of each machine; the circuit has none, because its test is of another kind.
    """
    return [one for name in MACHINES for one in _sets(name, seed, again)] + [_duffing(seed)]


def _sets(name: str, seed: int, again: int) -> list[PublicSet]:
    sample_time, make = MACHINES[name]
    index = list(MACHINES).index(name)
    rng = np.random.default_rng([seed, 2000 + index])
    n = int(rng.integers(*SIZES))
    drive = _steps(n, rng) if rng.integers(2) else _noise(n, rng)
    drive = _without_mean(drive) if name in CENTRED else drive
    u, machine = drive(rng), deepcopy(rng)
    cut = int(TRAINING_SHARE * n)
    logged = {output: _noisy(clean, rng) for output, clean in make(u, rng).items()}
    others: dict[str, dict[str, Part]] = {output: {} for output in logged}
    rng = np.random.default_rng([seed, OTHER_RECORDS_SEED, index])
    for number in range(again):
        v = drive(rng)
        for output, clean in make(v, deepcopy(machine)).items():
            others[output][f"record {number}"] = v[cut:, None], _noisy(clean, rng)[cut:]
    return [
        PublicSet(
            f"{name} {output}".strip(),
            True,
            sample_time,
            (u[:cut, None], y[:cut]),
            {"": (u[cut:, None], y[cut:])},
            SKIPPED_SAMPLES,
            others[output],
        )
        for output, y in logged.items()
    ]


def _noisy(y: Array, rng: np.random.Generator) -> Array:
    return y + rng.uniform(*NOISE) * y.std() * rng.normal(size=y.size)


def _steps(n: int, rng: np.random.Generator) -> Drive:
    """Return a function that draws levels from -1 to 1, each held for a random time."""
    longest = int(rng.integers(15, 60))
    return lambda rng: np.repeat(rng.uniform(-1.0, 1.0, n), rng.integers(5, longest, n))[:n]


def _noise(n: int, rng: np.random.Generator) -> Drive:
    """Return a function that draws low-passed noise with a peak of 1."""
    pole = float(rng.uniform(0.8, 0.97))

    def drawn(rng: np.random.Generator) -> Array:
        out = filtered([1.0 - pole], [1.0, -pole], rng.normal(size=n))
        return out / np.abs(out).max()

    return drawn


def _without_mean(drive: Drive) -> Drive:
    """Return the same, with the mean of each draw taken off: what the log holds, and what drives the machine."""

    def drawn(rng: np.random.Generator) -> Array:
        u = drive(rng)
        return u - u.mean()

    return drawn


def _flow(opening: float, above: float, below: float) -> float:
    """Return the air flow through an opening, choked or not, from the higher pressure to the lower one."""
    if above < below:
        return -_flow(opening, below, above)
    ratio = below / above
    return (
        opening
        * above
        * (
            1.0
            if ratio < CRITICAL_PRESSURE_RATIO
            else sqrt(1.0 - ((ratio - CRITICAL_PRESSURE_RATIO) / (1.0 - CRITICAL_PRESSURE_RATIO)) ** 2)
        )
    )


def _pneumatic(u: Array, rng: np.random.Generator) -> Outputs:
    """Return position, speed and pressures of a cylinder with an overlapped valve, LuGre friction and end stops."""
    overlap, conductance, mass = rng.uniform(0.02, 0.1), rng.uniform(0.5, 1.5), rng.uniform(2.0, 6.0)
    coulomb, extra, viscous = rng.uniform(5.0, 25.0), rng.uniform(2.0, 15.0), rng.uniform(20.0, 80.0)
    area, half, dead = 5e-4, 0.15, 0.03  # m^2, m, m
    stiff, loss, stribeck = 2e4, 120.0, 0.02  # of the bristles: N/m, N s/m, m/s
    steps, dt = 50, 0.01 / 50
    x, v, z, p, q = 0.0, 0.0, 0.0, 2.5, 2.5
    out = np.zeros((u.size, 3))
    for t, raw in enumerate(u.tolist()):
        out[t] = x, v, p - q
        opened = copysign(max(abs(raw) - overlap, 0.0), raw) * conductance
        for _ in range(steps):
            fed, drained = (SUPPLY, ATMOSPHERE) if opened > 0.0 else (ATMOSPHERE, SUPPLY)
            left, right = half + dead + x, half + dead - x
            p += dt * (_flow(abs(opened), fed, p) - p * v) / left
            q += dt * (_flow(abs(opened), drained, q) + q * v) / right
            sliding = (coulomb + extra * exp(-((v / stribeck) ** 2))) / stiff
            bristle = v - abs(v) * z / sliding
            z += dt * bristle
            stop = 1e5 * (min(x + half, 0.0) + max(x - half, 0.0))
            stop += 300.0 * v if abs(x) > half else 0.0
            v += dt * (1e5 * area * (p - q) - stiff * z - loss * bristle - viscous * v - stop) / mass
            x += dt * v
    return {"position": out[:, 0], "speed": out[:, 1], "pressure": out[:, 2]}


def _motor(u: Array, rng: np.random.Generator) -> Outputs:
    """Return the measured position and speed of a motor with armature lag, stiction and cogging."""
    rub, extra, damping = rng.uniform(0.05, 0.3), rng.uniform(0.02, 0.15), rng.uniform(0.02, 0.1)
    cogging, lag, inertia = rng.uniform(0.0, 0.08), rng.uniform(0.005, 0.03), rng.uniform(0.01, 0.05)
    steps, dt = 20, 0.01 / 20
    angle, v, torque = 0.0, 0.0, 0.0
    out = np.zeros((u.size, 2))
    for t, raw in enumerate(u.tolist()):
        out[t] = angle, v
        for _ in range(steps):
            torque += dt * (raw - 0.02 * v - torque) / lag
            held = rub + extra * exp(-((v / 0.1) ** 2))
            free = v + dt * (torque - damping * v - cogging * sin(6.0 * angle)) / inertia
            stopped = dt * held / inertia
            v = 0.0 if abs(free) <= stopped else free - copysign(stopped, free)
            angle += dt * v
    return {"position": out[:, 0], "speed": out[:, 1]}


def _boom(u: Array, rng: np.random.Generator) -> Outputs:
    """Return the measured signals of a boom with a pressure-compensated valve and a counterbalance valve."""
    dead, weight, stiff = rng.uniform(0.05, 0.2), rng.uniform(0.5, 1.5), rng.uniform(20.0, 80.0)
    pilot, damping, lag = rng.uniform(0.1, 0.3), rng.uniform(0.05, 0.4), rng.uniform(0.03, 0.15)
    steps, dt = 20, 0.02 / 20
    angle, v, p, spool = 0.2, 0.0, weight, 0.0
    out = np.zeros((u.size, 2))
    for t, raw in enumerate(u.tolist()):
        out[t] = p, v
        for _ in range(steps):
            spool += dt * (raw - spool) / lag
            flow = copysign(max(abs(spool) - dead, 0.0), spool)
            if flow < 0.0:  # lowering: the pressure of the other side opens the counterbalance valve
                flow *= min(max((p - 0.6 * weight) / pilot, 0.0), 1.0)
            p = max(p + dt * stiff * (flow - v), 0.0)
            stops = 2.0 * min(angle + 1.0, 0.0) + 5.0 * max(angle - 1.2, 0.0)
            v += dt * (p - weight * cos(angle) - damping * v - 0.05 * tanh(v / 0.01) - stops) / 0.3
            angle += dt * v
    return {"pressure": out[:, 0], "speed": out[:, 1]}


def _damper(u: Array, rng: np.random.Generator) -> Outputs:
    """Return the force of a magnetorheological damper against its speed, by the modified Bouc-Wen law."""
    inner, outer, spring = rng.uniform(0.5, 2.0), rng.uniform(5.0, 30.0), rng.uniform(0.0, 1.0)
    share, bend, grow = rng.uniform(2.0, 6.0), rng.uniform(20.0, 80.0), rng.uniform(10.0, 40.0)
    steps, dt = 20, 0.005 / 20
    moved, y, z = 0.0, 0.0, 0.0
    out = np.zeros(u.size)
    for t, raw in enumerate(u.tolist()):
        out[t] = outer * (share * z + inner * raw + 5.0 * (moved - y)) / (inner + outer) + spring * moved
        for _ in range(steps):
            rate = (share * z + inner * raw + 5.0 * (moved - y)) / (inner + outer)
            slip = raw - rate
            z += dt * (grow * slip - bend * abs(slip) * z)
            y += dt * rate
            moved += dt * (raw - 0.2 * moved)
    return {"": out}


def _drives(u: Array, rng: np.random.Generator) -> Outputs:
    """Return the speed of two drives coupled by a belt, measured without sign."""
    belt, damping, rub = rng.uniform(20.0, 80.0), rng.uniform(0.5, 2.0), rng.uniform(0.0, 0.1)
    steps, dt = 10, 0.02 / 10
    first, second, twist = 0.0, 0.0, 0.0
    out = np.zeros(u.size)
    for t, raw in enumerate(u.tolist()):
        out[t] = abs(second)
        for _ in range(steps):
            pull = belt * twist + 0.5 * (first - second)
            first += dt * (8.0 * raw - rub * tanh(first / 0.02) - damping * first - pull)
            second += dt * (pull - damping * second)
            twist += dt * (first - second)
    return {"": out}


def _exchanger(u: Array, rng: np.random.Generator) -> Outputs:
    """Return the cold-side temperature of a counterflow exchanger against its hot-side flow."""
    gain, cold, wall = rng.uniform(0.5, 2.0), rng.uniform(0.5, 1.0), rng.uniform(2.0, 6.0)
    steps, dt = 5, 1.0 / 5
    hot, warm, metal = np.zeros(CELLS), np.zeros(CELLS), np.zeros(CELLS)
    out = np.zeros(u.size)
    for t in range(-300, u.size):
        raw = float(u[max(t, 0)])
        flow = 0.6 + 0.5 * raw
        if t >= 0:
            out[t] = warm[0]
        for _ in range(steps):
            film = gain * max(flow, 0.05) ** 0.8
            into = np.concatenate([[1.0], hot[:-1]])
            next_cell = np.concatenate([warm[1:], [0.0]])
            given, taken = film * (hot - metal), gain * cold**0.8 * (metal - warm)
            hot = hot + dt * (max(flow, 0.05) * (into - hot) * 0.5 - 0.1 * given)
            warm = warm + dt * (cold * (next_cell - warm) * 0.5 + 0.1 * taken)
            metal = metal + dt * 0.1 * (given - taken) / wall
    return {"": out}


def _duffing(seed: int) -> PublicSet:
    """Return a circuit with a stiffening spring: fitted to a multisine, tested on an arrow of growing amplitude too."""
    rng = np.random.default_rng([seed, 3000])
    n, arrow = 8192, 4096
    hard, damping = rng.uniform(0.5, 2.0), rng.uniform(0.01, 0.04)
    lines = np.arange(1, 2 * int(rng.integers(150, 400)), 2)
    phases = rng.uniform(0.0, 2.0 * np.pi, lines.size)
    turns = 2.0 * np.pi * np.outer(np.arange(n), lines) / n
    multisine = np.cos(turns + phases).sum(axis=1)
    multisine *= 0.4 / multisine.std()
    grown = filtered([0.15], [1.0, -0.85], rng.normal(size=arrow))
    grown *= np.linspace(0.0, 1.0, arrow) * rng.uniform(1.2, 2.4) * np.abs(multisine).max() / np.abs(grown).max()
    u = np.concatenate([multisine, multisine[: n // 8], grown])
    y, v, x, dt = np.zeros(u.size), 0.0, 0.0, 0.25 / 5
    for t, raw in enumerate(u.tolist()):
        y[t] = x
        for _ in range(5):
            v += dt * (raw - x - hard * x**3 - 10.0 * damping * v)
            x += dt * v
    y = y + rng.uniform(*NOISE) * y[:n].std() * rng.normal(size=y.size)
    again, begun = slice(n, n + n // 8), n + n // 8
    tests = {"same drive": (u[again, None], y[again]), "arrow": (u[begun:, None], y[begun:])}
    return PublicSet("Duffing", True, 1.0 / 610.0, (u[:n, None], y[:n]), tests, 50)


MACHINES: Mapping[str, tuple[float, Callable[[Array, np.random.Generator], Outputs]]] = {
    "pneumatic": (0.01, _pneumatic),
    "motor": (0.01, _motor),
    "boom": (0.02, _boom),
    "damper": (0.005, _damper),
    "coupled drives": (0.02, _drives),
    "heat exchanger": (1.0, _exchanger),
}
"""Sample time [s] and measured outputs of each machine."""

CENTRED = ("damper",)
"""Machines whose input is a speed: its mean is zero, as the stroke is limited."""
