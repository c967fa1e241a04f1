"""The friction law differs from seal to seal: uncertainty of friction at rated speed in a slow log.

A circuit's friction has three parts (at rest, quadratic, whole at rated velocity). Friction of real seals first falls
with speed as oil is drawn under them (Stribeck), and then rises with another power than one or two. Friction at rated
velocity is measured if the piston comes near that; otherwise it is extrapolated by the three parts. So the law may
deviate from them by bends that fade within some velocity, with a judged size. Their effect on the three parts widens
classes and intervals.

Source: law and size of the fall, Olsson, Astrom, Canudas de Wit, Gafvert and Lischinsky, European Journal of Control 4
(1998), sections 2 and 3; an error of a model as an unknown with a prior, Kennedy and O'Hagan, Journal of the Royal
Statistical Society B 63 (2001). See decision 296.
"""

import numpy as np

from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import WEAK_PRIOR, PointFit
from plant.arrays import Array

FADE_VELOCITIES = (0.03, 0.1, 0.3)
"""Velocities within which a bend fades, over the rated one [fraction]: 1 to 13 mm/s on the paper's actuator. Seals of
cylinders have Stribeck velocities of one to some tens of millimetres per second."""

BEND_SPREAD = 0.1
"""Standard deviation of each bend over friction at rest [dimensionless], judged: all three together are 17 % at rest.
Breakaway friction of seals is 1.05 to 1.5 times that of sliding."""

SLIDING_VELOCITY = 0.005
"""Velocity over the rated one above which a piston slides [fraction]."""

RIDGE = 1e-7
"""Ridge of the regression [dimensionless]: one speed alone does not determine three parts."""

FORCE_PLACES = [at for at, name in enumerate(COORDINATES) if name.startswith("friction")]
"""Coordinates that are forces."""


def friction_bends(speed: Array) -> Array:
    """Return the bends of the friction law at one standard deviation, at sliding velocities.

    Parameters
    ----------
    speed : ndarray, shape (n,)
        Velocities over the rated one [fraction].

    Returns
    -------
    ndarray, shape (n, 3)
        Friction by each of `FADE_VELOCITIES`, over friction at rest [dimensionless].
    """
    return np.asarray(BEND_SPREAD * np.exp(-speed[:, None] / np.array(FADE_VELOCITIES)))


def bend_shifts(fit: PointFit, blocks: Blocks, actuator: Actuator) -> Array:
    """Return the response of a fit to unknown bends of the friction law.

    A search fits the three parts to friction at the velocities that were reached. A bend shifts them as it would shift
    a regression. The residuals of the log are not used: a piston that reverses leaves errors of the seals' elasticity
    that look like a bend.

    Returns
    -------
    ndarray, shape (7, 3)
        Shift of the coordinates by each of `FADE_VELOCITIES` at one standard deviation [dimensionless].
    """
    speed = np.abs(fit.fitted[blocks.first :, 0][blocks.valid[:, 0]]) / actuator.rated
    speed = np.append(speed[speed > SLIDING_VELOCITY], 0.0)  # friction at rest shows when the piston breaks loose
    parts = np.stack([np.ones_like(speed), speed, speed**2], axis=1)
    bends = friction_bends(speed)
    rest, linear, quadratic = np.linalg.solve(parts.T @ parts + RIDGE * len(speed) * np.eye(3), parts.T @ bends)
    forces = np.exp(fit.coordinates[FORCE_PLACES])
    moved = np.zeros((len(fit.coordinates), len(FADE_VELOCITIES)))
    moved[FORCE_PLACES] = np.array([rest, quadratic, rest + linear + quadratic]) * (forces[0] / forces)[:, None]
    return moved


def bent_information(information: Array, moved: Array) -> Array:
    """Return the information of a log on a circuit whose friction law may be bent.

    Parameters
    ----------
    information : ndarray, shape (7, 7)
        Its information if the law had the circuit's shape.
    moved : ndarray, shape (7, m)
        Shift of the coordinates by bends, see `bend_shifts`.

    Returns
    -------
    ndarray, shape (7, 7)
        Inverse of the covariance including bends; also defined for singular information.

    Examples
    --------
    >>> bent_information(np.diag([4.0, 0.0]), np.array([[0.5], [0.0]])).tolist()
    [[2.0, 0.0], [0.0, 0.0]]
    """
    along = information @ moved
    return np.asarray(information - along @ np.linalg.solve(np.eye(moved.shape[1]) + moved.T @ along, along.T))


def bend_covariance(information: Array, moved: Array) -> Array:
    """Return the covariance that bends of the friction law add to a circuit's coordinates.

    Parameters
    ----------
    information : ndarray, shape (7, 7)
        As in `bent_information`.
    moved : ndarray, shape (7, m)
        As in `bent_information`.

    Returns
    -------
    ndarray, shape (7, 7)
        Covariance [dimensionless]; no more than the weak prior allows.
    """
    weak = np.linalg.inv(WEAK_PRIOR)
    bent, straight = (np.linalg.inv(one + weak) for one in (bent_information(information, moved), information))
    return np.asarray(bent - straight, dtype=np.float64)
