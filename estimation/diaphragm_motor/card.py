"""Identifiability card of the diaphragm motor's sensors: bulk modulus cannot be identified, gas can."""

from dataclasses import replace
from math import sqrt

import numpy as np

from estimation.diaphragm_motor.signature import DRIVE, POSITION, modelled_signature, tolerance
from estimation.trust.card import Card
from plant.diaphragm_motor.flow import operate
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import ELECTRODES

UNKNOWNS = ("bulk_modulus", "gas_fraction", "crossport_leakage", "load_force")
"""Unknowns of the card."""

LEAKAGE, LOAD = 2e-12, 10.0
"""Reference sizes of leakage [m^3/(s Pa)] and load [N]."""

MOST_LEAKAGE = 2e-11
"""Largest leakage across the piston that counts as a leak [m^3/(s Pa)]: it takes two thirds of the velocity under 10 N
(200 V, 480 Hz)."""


def flow_change(p: DiaphragmMotorParameters, frequency: float, peak_to_peak: float, factor: float) -> float:
    """Return the change of mean flow with bulk modulus.

    Parameters
    ----------
    frequency, peak_to_peak : float
        Frequency and swing of the drive [Hz], [V].
    factor : float
        Factor on bulk modulus [dimensionless].

    Returns
    -------
    float
        Relative change [fraction].

    Examples
    --------
    >>> abs(flow_change(DiaphragmMotorParameters(), 480.0, 200.0, 2.0)) < 1e-3
    True
    """
    other = operate(replace(p, bulk_modulus=factor * p.bulk_modulus), frequency, peak_to_peak).outlet_flow
    return other / operate(p, frequency, peak_to_peak).outlet_flow - 1.0


def motor_card(p: DiaphragmMotorParameters, frequency: float, peak_to_peak: float) -> Card:
    """Return the identifiability of bulk modulus, gas, leakage and load under a sine, all unknown together.

    Cramér-Rao bounds with the tolerance to which a motor agrees with its model, and a prior of 100 % on each. The
    liquid's bulk modulus has only the effect of V_0/beta beside the diaphragm's compliance C_d, which is 400 times as
    large.

    Parameters
    ----------
    frequency, peak_to_peak : float
        Frequency and swing of the drive [Hz], [V].

    Returns
    -------
    Card
        Relative standard deviations; leakage's and load's relative to `LEAKAGE` and `LOAD`.

    Examples
    --------
    >>> card = motor_card(DiaphragmMotorParameters(load_force=10.0), 480.0, 200.0)
    >>> card.relative_std["bulk_modulus"] > 0.9, card.relative_std["load_force"] < 0.1
    (True, True)
    """
    base = modelled_signature(p, frequency, peak_to_peak)
    whitening = np.linalg.inv(np.linalg.cholesky(tolerance(p, frequency, peak_to_peak)))
    moved = {
        "bulk_modulus": replace(p, bulk_modulus=(1.0 + _STEP) * p.bulk_modulus),
        "gas_fraction": replace(p, gas_fraction=tuple((1.0 + _STEP) * share for share in p.gas_fraction)),
        "crossport_leakage": replace(p, crossport_leakage=p.crossport_leakage + _STEP * LEAKAGE),
        "load_force": replace(p, load_force=p.load_force + _STEP * LOAD),
    }
    slopes = [(modelled_signature(moved[name], frequency, peak_to_peak) - base) / _STEP for name in UNKNOWNS]
    scaled = whitening @ np.column_stack(slopes)
    covariance = np.linalg.inv(scaled.T @ scaled + np.eye(len(UNKNOWNS)))
    deviations = np.sqrt(np.diag(covariance))
    values, directions = np.linalg.eigh(covariance)
    bounds = {name: float(std) for name, std in zip(UNKNOWNS, deviations, strict=True)}
    return Card(
        channels=(DRIVE, *ELECTRODES, POSITION),
        unknowns=UNKNOWNS,
        relative_std=bounds,
        known_exactly=bounds,
        correlation=covariance / np.outer(deviations, deviations),
        friction_force=1.0,
        weakest=dict(zip(UNKNOWNS, directions[:, -1].tolist(), strict=True)),
        weakest_std=sqrt(float(values[-1])),
        stuck=0.0,
        uncertainties={},
    )


_STEP = 0.05
