"""Scores of the nine conditions' regions for a fitted circuit, and how far a log separates them.

A region is Gaussian in the logarithms of the fitted parameters, as actuators of one kind differ in them. So is the
likelihood if it is narrow. If it is wide, friction is treated as forces, since pressure is linear in them.
"""

import numpy as np

from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.class_fit import CONDITION_SPREAD, PointFit
from faults.diagnosis.circuits.friction_shape import FORCE_PLACES
from plant.arrays import Array


def region_scores(fit: PointFit, information: Array, actuator: Actuator) -> Array:
    """Return the score of each condition's region for a fitted circuit: the log of the likelihood over the region.

    Parameters
    ----------
    fit : PointFit
        The circuit.
    information : ndarray, shape (7, 7)
        Inverse covariance of its coordinates; directions without information do not count.

    Returns
    -------
    ndarray, shape (9,)
        Log-likelihoods [dimensionless] up to a constant.
    """
    off = fit.coordinates - actuator.conditions
    weight = information @ np.linalg.inv(np.eye(len(information)) + CONDITION_SPREAD @ information)
    return -0.5 * np.einsum("ci,ij,cj->c", off, weight, off)


def scores_in_forces(fit: PointFit, told: Array, actuator: Actuator) -> Array:
    """Return the score of each condition's region for a fitted circuit, with friction as forces.

    Pressure is linear in the forces of friction and not in their logarithms: a quadratic part known to ± 900 N may be
    100 N or 1900 N, and both are one deviation off.

    Parameters
    ----------
    fit : PointFit
        The circuit.
    told : ndarray, shape (7, 7)
        Credible inverse covariance of its coordinates.

    Returns
    -------
    ndarray, shape (9,)
        Log-likelihoods [dimensionless] up to a constant.
    """
    off, sizes = _offsets_in_forces(fit, actuator)
    blurred, usual = (np.eye(len(told)) + within @ told for within in (_region_covariances(sizes), CONDITION_SPREAD))
    volumes = np.linalg.slogdet(blurred)[1] - np.linalg.slogdet(usual)[1]  # a wide region counts less
    return -0.5 * (np.einsum("ci,cij,cj->c", off, told @ np.linalg.inv(blurred), off) + volumes)


def separations(spread: Array, actuator: Actuator) -> Array:
    """Return the separation of each pair of conditions by a log, as an expected log-likelihood ratio.

    Parameters
    ----------
    spread : ndarray, shape (7, 7)
        Covariance of the coordinates for intervals, see `ClassFits`.

    Returns
    -------
    ndarray, shape (9, 9)
        Half the squared distance between their regions, in deviations that include the log's [dimensionless].
    """
    between = actuator.conditions[:, None] - actuator.conditions
    return 0.5 * np.einsum("abi,ij,abj->ab", between, np.linalg.inv(CONDITION_SPREAD + spread), between)


def separations_in_forces(fit: PointFit, spread: Array, actuator: Actuator) -> Array:
    """Return the separation of each pair of conditions by a log, with friction as forces.

    Parameters
    ----------
    fit : PointFit
        The circuit.
    spread : ndarray, shape (7, 7)
        Covariance of its coordinates, with the effect of bends.

    Returns
    -------
    ndarray, shape (9, 9)
        Half the squared distance between their regions, in deviations that include the log's [dimensionless].
    """
    off, sizes = _offsets_in_forces(fit, actuator)
    within = _region_covariances(sizes)
    between = off[:, None] - off
    blurred = np.linalg.inv(0.5 * (within[:, None] + within) + spread)
    return np.asarray(0.5 * np.einsum("abi,abij,abj->ab", between, blurred, between), dtype=np.float64)


def _offsets_in_forces(fit: PointFit, actuator: Actuator) -> tuple[Array, Array]:
    """Return the offset of a circuit from each condition and the weight of a logarithm; forces over the circuit's."""
    off = fit.coordinates - actuator.conditions
    sizes = np.ones_like(off)
    sizes[:, FORCE_PLACES] = np.exp(-off[:, FORCE_PLACES])
    off[:, FORCE_PLACES] = 1.0 - sizes[:, FORCE_PLACES]
    return off, sizes


def _region_covariances(sizes: Array) -> Array:
    """Return the covariance of each region with friction as forces, shape (9, 7, 7)."""
    return sizes[:, :, None] * CONDITION_SPREAD * sizes[:, None, :]
