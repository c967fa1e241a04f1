"""Known systems and noisy records of them, for the benchmarks of identification."""

from dataclasses import dataclass

import numpy as np

from estimation.identification import LinearModel
from experiments.published import load

NOISES = (0.01, 0.1, 0.5)
"""Standard deviation of the output noise relative to that of the output."""

_PUBLISHED = load("transfer_functions").set_index("condition")

TABLE_6 = {
    str(name): LinearModel(
        row[["b0", "b1", "b2"]].to_numpy(float),
        np.array([1.0, row["a1"], row["a2"]], dtype=float),
        1e-3,
        "motor_speed_rad_s",
        "velocity_m_s",
    )
    for name, row in _PUBLISHED.iterrows()
}
"""The published transfer functions at the inferred sample time (errata E14)."""


@dataclass(frozen=True, eq=False)
class Case:
    """A known system and one noisy record of it."""

    truth: LinearModel
    u: np.ndarray
    y: np.ndarray
    noise_std: float


def table6_case(name: str, noise: float, seed: int, n: int = 20_000) -> Case:
    """Return a record of one model of Table 6."""
    rng = np.random.default_rng([6, list(TABLE_6).index(name), round(100 * noise), seed, n])
    return noisy_case(TABLE_6[name], random_binary(rng, n), noise, rng)


def random_binary(rng: np.random.Generator, n: int, hold: int = 50) -> np.ndarray:
    """Return +-125.66 rad/s, each value held for a number of samples."""
    return 125.66 * np.repeat(rng.choice([-1.0, 1.0], n // hold + 1), hold)[:n]


def noisy_case(truth: LinearModel, u: np.ndarray, share: float, rng: np.random.Generator) -> Case:
    """Return a record with white output noise."""
    clean = truth.simulate(u)
    std = share * float(clean.std())
    return Case(truth, u, clean + std * rng.standard_normal(u.size), std)


def random_system(seed: int, n: int = 2_000) -> Case:
    """Return a record of a random stable system of order 2 to 4, with a signal-to-noise ratio of 10 to 30 dB.

    Poles are real or in pairs, with moduli from 0.3 to 0.98; zeros are drawn likewise within 1.2. The input is random
    binary, held for 1 to 10 samples.
    """
    rng = np.random.default_rng([200, seed])
    order = 2 + seed % 3
    f = np.real(np.poly(_roots(rng, order, 0.3, 0.98)))
    b = np.real(np.poly(_roots(rng, order, 0.0, 1.2)))
    truth = LinearModel(b * f.sum() / max(abs(b.sum()), 0.05), f, 1.0, "u", "y")
    u = np.repeat(rng.choice([-1.0, 1.0], n), int(rng.integers(1, 11)))[:n]
    return noisy_case(truth, u, 10.0 ** (-rng.uniform(10.0, 30.0) / 20.0), rng)


def _roots(rng: np.random.Generator, order: int, low: float, high: float) -> np.ndarray:
    roots: list[complex] = []
    while len(roots) < order:
        radius = rng.uniform(low, high)
        if order - len(roots) >= 2 and rng.random() < 0.6:
            pole = radius * np.exp(1j * rng.uniform(0.02, np.pi))
            roots += [pole, np.conj(pole)]
        else:
            roots.append(radius * rng.choice([1.0, 1.0, 1.0, -1.0]))
    return np.array(roots)
