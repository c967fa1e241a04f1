"""The load on the rod from the force balance of a sliding piston, without a model of how it breaks loose.

While the piston slides in one direction, its friction is a smooth function of its speed. So pressure times area is
linear in a constant force, a spring and an inertia on the rod, and in the coefficients of friction. If it slides in one
direction only, friction at rest is known as far as conditions differ in it, and a constant force no better.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import LASTING
from plant.arrays import Array
from plant.components.oil import ATMOSPHERE
from plant.eha.model import EhaParameters

BREAKAWAY_TRAVEL = 1e-4
"""Travel after a reversal from which friction is that of sliding [m]: five times the strain of the seals; judged."""

LEAST_SPEED_TO_NOISE = 4.0
"""Velocity over its noise from which its direction is known [dimensionless], in standard deviations."""

FEWEST = 20
"""Least number of blocks with a sliding piston [count]: 0.2 s."""

FRICTION_SPREAD = 0.3
"""Relative difference of friction at rest within a condition [dimensionless], as in `WEAK_PRIOR`."""

WIDE_PRIOR = 10.0
"""Prior size of the other coefficients, over the largest in any condition [dimensionless]."""

SURE_DEVIATIONS = 4.0
"""Standard deviations from which a load is believed [dimensionless]. In 119 plain training logs none exceeds 1.4."""

LEAST_SHARES = {"load_force": 0.05, "load_stiffness": 0.01, "moving_mass": 0.01}
"""Share of the pressure force, root mean square, from which a load matters [fraction]: a sensor offset can look like a
constant force, which counts from 0.05 on, and nothing looks like the others."""

HIDDEN_INERTIA = 8.0
"""Standard deviation of an inertia that friction may hide, as it lags behind speed [kg]: of 60 to 300 kg up to 12 were
hidden in training logs in which the balance alone was certain to 4."""

LOAD_NAMES = tuple(LEAST_SHARES)
"""Loads on a rod, as in the actuator's entries."""


@dataclass(frozen=True, eq=False)
class Loads:
    """Loads on the rod that the rig file does not state.

    Parameters
    ----------
    values : ndarray, shape (3,)
        Additional constant force against extension [N], stiffness of a spring that is free at position zero [N/m], and
        moving mass [kg].
    std : ndarray, shape (3,)
        Their standard deviations.
    shares : ndarray, shape (3,)
        Size of each force over that of the pressure, both root mean square [fraction].
    """

    values: Array
    std: Array
    shares: Array

    @property
    def certain(self) -> tuple[str, ...]:
        """Those of `LOAD_NAMES` that are certain; springs and masses are positive."""
        sure = np.abs(self.values) > SURE_DEVIATIONS * self.std
        sure[1:] &= self.values[1:] > 0.0
        return tuple(name for name, one in zip(LOAD_NAMES, sure, strict=True) if one)

    @property
    def significant(self) -> tuple[str, ...]:
        """Those that are also large enough to matter."""
        large = dict(zip(LOAD_NAMES, self.shares, strict=True))
        return tuple(name for name in self.certain if large[name] > LEAST_SHARES[name])

    def of(self, name: str) -> tuple[float, float]:
        """Return a load and its standard deviation [N, N/m or kg]."""
        at = LOAD_NAMES.index(name)
        return float(self.values[at]), float(self.std[at])


class Balance(NamedTuple):
    """Force balance of a piston over the m blocks, of n, in which it slides.

    Parameters
    ----------
    use : ndarray, shape (n,)
        Which blocks these are.
    columns : ndarray, shape (m, 6)
        Regressors of a force, a spring, an inertia, and friction at rest, linear and quadratic [SI].
    push : ndarray, shape (m,)
        Force of the pressure, less inertia and load of the rig file [N].
    pressure : ndarray, shape (m,)
        Differential pressure [Pa].
    """

    use: NDArray[np.bool_]
    columns: Array
    push: Array
    pressure: Array


def force_balance(blocks: Blocks, p: EhaParameters) -> Loads | None:
    """Return the load on the rod from the force balance of the sliding piston.

    Parameters
    ----------
    p : EhaParameters
        The actuator, as its rig file has it.

    Returns
    -------
    Loads or None
        The load; None without pressure, and if the piston hardly slides.
    """
    balance = sliding_balance(blocks, p)
    if balance is None:
        return None
    columns, push = balance.columns, balance.push
    believed, spread = friction_prior(p)
    count = len(LOAD_NAMES)
    found, covariance = _regression(
        columns, push, np.append(np.zeros(count), believed), np.append(np.full(count, np.inf), spread)
    )
    values, std = found[:count], np.sqrt(np.maximum(np.diag(covariance)[:count], 0.0))
    # with unequal areas, the inner circuit's pressure exerts a force, and that pressure is not measured
    std = np.hypot(std, [p.piston_area * p.area_difference * _twice_held_pressure(p), 0.0, HIDDEN_INERTIA])
    size = p.piston_area * float(np.sqrt(np.mean(balance.pressure**2)))
    forces = np.abs(values) * [1.0, float(np.std(columns[:, 1])), float(np.std(columns[:, 2]))]
    return Loads(values, std, forces / max(size, np.finfo(np.float64).tiny))


def sliding_balance(blocks: Blocks, p: EhaParameters) -> Balance | None:
    """Return the force balance of the sliding piston: the pressure force, and what may oppose it.

    Parameters
    ----------
    p : EhaParameters
        The actuator, as its rig file has it.

    Returns
    -------
    Balance or None
        None without pressure, and if the piston hardly slides.
    """
    if blocks.pressure is None:
        return None
    step = blocks.block * blocks.sample_time
    velocity = np.nan_to_num(blocks.velocity)
    position = blocks.place + step * (np.cumsum(velocity) - 0.5 * velocity)
    use = sliding_blocks(blocks) & np.isfinite(blocks.pressure)
    use[: blocks.first] = False
    if np.count_nonzero(use) < FEWEST:
        return None
    v, dp, x, a = velocity[use], blocks.pressure[use], position[use], np.gradient(velocity, step)[use]
    push = (
        p.piston_area * (dp + p.area_difference * (_twice_held_pressure(p) + np.abs(dp)))
        - p.moving_mass * a
        - p.load_force
        - p.load_stiffness * x
    )
    return Balance(use, np.column_stack([np.ones(len(v)), x, a, np.sign(v), v, v * np.abs(v)]), push, dp)


def _twice_held_pressure(p: EhaParameters) -> float:
    """Return twice the gauge pressure of the chamber at the inner circuit's pressure [Pa]."""
    return 2.0 * (p.accumulator_pressure - ATMOSPHERE)


def _regression(columns: Array, push: Array, centre: Array, doubt: Array) -> tuple[Array, Array]:
    """Return coefficients and their covariance, from their priors and with lasting errors."""
    sizes = np.maximum(np.max(np.abs(columns), axis=0), np.finfo(np.float64).tiny)
    scaled, pull = columns / sizes, 1.0 / (doubt * sizes) ** 2
    begun = centre * sizes
    noise, found, known = float(np.var(push)), begun, np.eye(len(sizes))
    for _ in range(2):  # the first pass finds the size of the residuals, the second uses it
        weight = 1.0 / (LASTING * max(noise, np.finfo(np.float64).tiny))
        known = weight * scaled.T @ scaled + np.diag(pull + 1e-12 * weight * len(push))
        found = begun + np.linalg.solve(known, weight * scaled.T @ (push - scaled @ begun))
        noise = float(np.mean((push - scaled @ found) ** 2))
    return found / sizes, np.linalg.inv(known) / np.outer(sizes, sizes)


def sliding_blocks(blocks: Blocks) -> NDArray[np.bool_]:
    """Return the blocks in which the piston has slid one way long enough for steady sliding friction.

    Returns
    -------
    ndarray, shape (n,)
        Whether it has, by block.
    """
    velocity, step = np.nan_to_num(blocks.velocity), blocks.block * blocks.sample_time
    way = np.sign(velocity)
    gone = np.cumsum(np.abs(velocity)) * step
    turned = np.append(True, way[1:] != way[:-1])
    since = gone - np.maximum.accumulate(np.where(turned, gone, 0.0))
    same = np.append(way[1:] == way[:-1], False)
    return (
        np.isfinite(blocks.velocity)
        & same
        & (since > BREAKAWAY_TRAVEL)
        & (np.abs(velocity) > LEAST_SPEED_TO_NOISE * blocks.noise[0])
    )


def friction_prior(p: EhaParameters) -> tuple[Array, Array]:
    """Return the prior of friction, whatever the condition.

    Parameters
    ----------
    p : EhaParameters
        The healthy actuator.

    Returns
    -------
    tuple of ndarray, each of shape (3,)
        Friction at rest [N], its linear [N s/m] and its quadratic part [N s^2/m^2], and their deviations.
    """
    each = [parameters_for(condition, p) for condition in CONDITIONS.values()]
    rest, linear, bent = np.array([[q.friction_coulomb, q.friction_linear, q.friction_quadratic] for q in each]).T
    middle = float(np.mean(rest))
    spread = np.array(
        [float(np.std(rest)) + FRICTION_SPREAD * middle, WIDE_PRIOR * np.max(np.abs(linear)), WIDE_PRIOR * np.max(bent)]
    )
    return np.array([middle, 0.0, 0.0]), np.maximum(spread, np.finfo(np.float64).tiny)
