"""How far off may a fitted circuit be? The doubt of severities where pressure is logged.

A circuit that is fitted to a log has the rig's seals, make-up valves, mass and accumulator, and a judged share of its
leakage in the pump. Where those are others, what is fitted gives way. So they are unknowns beside the fitted ones for
one linear step, each with the spread that is judged of it: what the log leaves open of them widens the intervals, and
so does what it says of them, because the fit did not go that way (consider covariance: Tapley, Schutz and Born,
Statistical Orbit Determination, 2004, chapter 6). What is left of a log that no sensor makes is a wrong model's error,
which a longer log does not average away; that is counted here, and once.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from faults.diagnosis.actuator import Actuator
from faults.diagnosis.blocks import Blocks
from faults.diagnosis.circuit_runs import COLUMN, parameter_rows, predicted
from faults.diagnosis.class_fit import WEAK, PointFit
from plant.arrays import Array

SELDOM_KNOWN: Mapping[str, float] = MappingProxyType(
    {
        "presliding_damping": 0.53,
        "makeup_opening": 0.93,
        "moving_mass": 0.15,
        "accumulator_pressure": 0.23,
        "pump_case_leakage": 0.03,
        "pump_crossport_leakage": 0.26,
    }
)
"""Standard deviations, judged: of logarithms, and of the pump's two leakages as shares of the whole [dimensionless]."""

_SHARES: Mapping[str, float] = MappingProxyType({"pump_case_leakage": 1.0, "pump_crossport_leakage": -1.0})
"""Ways in which shares are nudged: the cylinder leaks the rest."""

NUDGE = 0.05
"""Step of the finite differences in logarithms and shares [dimensionless]."""

LOOKS = 5.0
"""Independent looks that a log gives at a wrong model's error, however long it is [dimensionless]."""


def spreads_of(actuator: Actuator) -> Array:
    """Return how far off what is seldom known may be of an actuator.

    Parameters
    ----------
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    ndarray, shape (m,)
        Standard deviations of `SELDOM_KNOWN`, and of the force on its rod over itself where a log had to tell that.
    """
    spreads = list(SELDOM_KNOWN.values())
    if actuator.load_doubt > 0.0:
        spreads.append(actuator.load_doubt / max(abs(actuator.circuit.load_force), actuator.load_doubt))
    return np.array(spreads)


def seldom_known_slopes(fit: PointFit, blocks: Blocks, actuator: Actuator) -> Array:
    """Return how the outputs answer `SELDOM_KNOWN` and the force on the rod, by one run of circuits side by side.

    Parameters
    ----------
    fit : PointFit
        The fit.
    blocks : Blocks
        Its log.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    ndarray, shape (m, n, outputs)
        Derivatives with respect to logarithms and shares, in the order of `spreads_of` [m/s, Pa].
    """
    (row,) = parameter_rows(fit.coordinates[None], actuator.circuit, actuator.rated)
    names = [*SELDOM_KNOWN, *(["load_force"] if actuator.load_doubt > 0.0 else [])]
    rows = np.tile(row, (1 + len(names), 1))  # circuits that run side by side share their steps' errors
    for nudged, name in zip(rows[1:], names, strict=True):
        at = COLUMN[name]
        if name == "load_force":
            nudged[at] += NUDGE * max(abs(row[at]), actuator.load_doubt)
        elif name in _SHARES:
            nudged[at] += _SHARES[name] * NUDGE * row[COLUMN["leakage_coefficient"]]
        else:
            nudged[at] *= np.exp(NUDGE)
    steps = np.array([NUDGE * _SHARES.get(name, 1.0) for name in names])
    runs = predicted(blocks, rows)
    return (runs[1:] - runs[0]) / steps[:, None, None]


def doubt_of(
    fit: PointFit,
    seldom: Array,
    blocks: Blocks,
    centres: Array,
    odds: Array,
    seen: Array,
    spreads: Array,
) -> Array:
    """Return the second moment of a fit's error in its coordinates.

    Parameters
    ----------
    fit : PointFit
        The fit.
    seldom : ndarray, shape (m, n, outputs)
        How the outputs answer what is seldom known, see `seldom_known_slopes`.
    blocks : Blocks
        Its log, with pressure.
    centres : ndarray, shape (conditions, 7)
        Coordinates of the conditions about which the weak prior may lie.
    odds : ndarray, shape (conditions,)
        Log-likelihoods of the conditions [dimensionless], up to a constant.
    seen : ndarray, shape (7,)
        1 for what the log can tell, 0 for what it cannot, as friction of a piston that sticks.
    spreads : ndarray, shape (m,)
        Standard deviations of what is seldom known, see `spreads_of`.

    Returns
    -------
    ndarray, shape (7, 7)
        Covariance, and the squares of the steps that prior and log ask for [dimensionless].
    """
    first, known = blocks.first, len(fit.coordinates)
    left = (blocks.outputs - fit.fitted)[first:]
    unexplained = np.maximum(1.0 - (blocks.noise / fit.scales) ** 2, 0.0)
    weight = fit.scales * np.sqrt(1.0 + unexplained * blocks.counts / LOOKS)
    slopes = np.concatenate([fit.slopes * seen[:, None, None], seldom])[:, first:]
    slopes = np.where(blocks.seen, slopes / weight, 0.0).reshape(len(slopes), -1)
    prior = np.zeros((len(slopes), len(slopes)))
    prior[:known, :known] = np.linalg.inv(WEAK)
    prior[known:, known:] = np.diag(spreads**-2.0)
    covariance = np.linalg.inv(slopes @ slopes.T + prior)
    pulled = slopes @ np.where(blocks.seen, left / weight, 0.0).ravel()
    steps = (covariance @ (pulled + (centres - fit.coordinates) @ prior[:known]).T)[:known]
    shares = np.exp(odds - np.max(odds))
    return np.asarray(covariance[:known, :known] + (steps * shares / np.sum(shares)) @ steps.T, dtype=np.float64)
