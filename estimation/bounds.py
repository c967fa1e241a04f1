"""How well could anyone do? The posterior Cramér-Rao bound along a drive."""

from collections.abc import Mapping
from dataclasses import fields

import numpy as np

from estimation.eha import BULK_MODULUS
from estimation.ekf import ekf
from estimation.gaussian import Gaussian
from estimation.identification.preprocess import bridged
from estimation.model import ProcessModel
from estimation.run import run_filter
from plant.eha import EhaParameters
from plant.integrate import compile_trajectory, parameter_row
from plant.record import Record


def bulk_modulus_bound(
    model: ProcessModel,
    prior: Gaussian,
    record: Record,
    parameters: EhaParameters,
    *,
    channels: tuple[str, ...],
    variances: Mapping[str, float],
    noise: Mapping[str, float] | None = None,
) -> float:
    """Return the least standard deviation that bulk modulus can be known to from this drive and these sensors.

    The posterior Cramér-Rao bound (Tichavský, Muravchik and Nehorai 1998, equation 21) is the covariance recursion of
    the extended Kalman filter along the true trajectory. So the filter is run on what its own model does, noiseless,
    under the record's drive with the parameters' bulk modulus: its mean stays on the trajectory and its covariance is
    the bound. While the piston sticks, position and velocity hold nothing about bulk modulus (errata E13).

    Parameters
    ----------
    model : ProcessModel
        A model with the state ``bulk_modulus_pa``.
    prior : Gaussian
        Belief before the log, in SI; only its covariance and initial position count.
    record : Record
        The drive, on its clock.
    parameters : EhaParameters
        The actuator, at the bulk modulus for which the bound is wanted.
    channels : tuple of str
        Channels measured.
    variances : Mapping[str, float]
        Their variances [SI squared].
    noise : Mapping[str, float], optional
        Process-noise densities that replace the model's [SI squared a second].

    Returns
    -------
    float
        Standard deviation [Pa]; infinite where the model's own run does not stay finite.
    """
    start = prior.mean.copy()
    start[model.index(BULK_MODULUS)] = parameters.bulk_modulus
    run = compile_trajectory(f"{model.name}_form", model.step, model.width)
    speed = bridged(record["motor_speed_rad_s"])
    substeps = max(1, round(record.sample_time / 1e-4))
    states = run(start, speed, parameter_row(parameters)[None], record.sample_time, substeps)
    if not np.all(np.isfinite(states)):
        return float("inf")
    predicted = model.observe(tuple(states.T), parameters)
    noiseless = Record(
        record.sample_time,
        {"motor_speed_rad_s": speed, **{channel: predicted[channel] for channel in channels}},
        start_time=record.start_time,
    )
    centred = Gaussian(start, prior.covariance)
    estimate = run_filter(
        ekf, model, centred, noiseless, parameters, channels=channels, variances=variances, noise=noise
    )
    _, std = estimate.track(BULK_MODULUS)
    return float(std[-1]) if np.isfinite(std[-1]) else float("inf")


def at_bulk_modulus(parameters: EhaParameters, bulk_modulus: float) -> EhaParameters:
    """Return what a process model knows of the actuator, at another bulk modulus.

    Parameters
    ----------
    parameters : EhaParameters
        The actuator.
    bulk_modulus : float
        Effective bulk modulus [Pa], convention of equation 5.8 (errata E2).

    Returns
    -------
    EhaParameters
        A copy of the parameters that every actuator has; a circuit's further ones play no part in a bound.
    """
    known = {field.name: getattr(parameters, field.name) for field in fields(EhaParameters)}
    return EhaParameters(**{**known, "bulk_modulus": bulk_modulus})
