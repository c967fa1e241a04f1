"""`fit_flow(record, parameters) -> FlowFit`: bulk modulus, leakage and flow bias of a log, by the flow form."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from estimation.flow import FLOW_FORM, RELIEVING_FLOW_FORM
from estimation.greybox import GreyBoxFit, fit_greybox
from estimation.identification.preprocess import bridged
from estimation.measurement_noise import measurement_variances
from plant.eha import EhaParameters
from plant.errors import LogError
from plant.integrate import parameter_row
from plant.record import Record

FLOW_CHANNELS = ("position_m", "differential_pressure_pa")
"""Channels that the flow form needs beside motor speed."""

REPORTED = ("leakage_coefficient", "flow_bias")
"""What is worth telling of the parameters found along with bulk modulus."""

FAULTS_TRIED = ((1.0, 1.0), (5.0, 6.0), (12.5, 6.0))
"""Leakage and flow bias of the starts, as multiples of the healthy actuator's: the spread of Table 3."""

MAKEUP_TRIED = (1e-9, 1e-13)
"""Make-up conductances of the starts [m^3/(s Pa)]: a circuit with make-up valves, and one without."""

LEAD_START = 1e-5
"""First guess of the motor's lead on the straight line between samples [s]."""

LONGEST_STEP = 2.5e-4
"""Longest step of the chamber balance [s]; slower logs are sub-stepped."""

NEAR_RELIEF = 0.97
"""Share of the relief setting above which the valve is taken to open [fraction]."""

LARGEST_CHI_SQUARE = 1.2
"""Mean squared normalised residual above which the model is said to leave something out [dimensionless]."""

LARGEST_AUTOCORRELATION = 0.1
"""Correlation of neighbouring residuals above which the same is said [dimensionless]."""


@dataclass(frozen=True, eq=False)
class FlowFit:
    """What the pressure balance of a log says.

    Parameters
    ----------
    parameters : Mapping[str, tuple of float]
        Value and standard deviation in SI, by parameter name.
    bound : float
        Relative standard deviation of bulk modulus [fraction].
    chi_square : float
        Mean squared residual over the sensor's variance [dimensionless].
    reasons : tuple of str
        What speaks against the fit, one sentence each.
    residual : ndarray, shape (n,)
        Differential pressure, measured less predicted [Pa].
    """

    parameters: Mapping[str, tuple[float, float]]
    bound: float
    chi_square: float
    reasons: tuple[str, ...]
    residual: NDArray[np.float64]


def fit_flow(record: Record, parameters: EhaParameters, bulk_modulus: float) -> FlowFit:
    """Fit the flow form to a log.

    Parameters
    ----------
    record : Record
        The log, with position and differential pressure; it begins at rest.
    parameters : EhaParameters
        Geometry and pump are taken from it; leakage and flow bias are first guesses.
    bulk_modulus : float
        First guess of effective bulk modulus [Pa].

    Returns
    -------
    FlowFit
        The best of several starts.

    Raises
    ------
    LogError
        If a channel is missing.
    """
    lacking = [channel for channel in FLOW_CHANNELS if channel not in record]
    if lacking:
        raise LogError(f"the flow form needs {' and '.join(FLOW_CHANNELS)}, the record lacks {', '.join(lacking)}")
    pressure = record["differential_pressure_pa"]
    relieved = float(np.nanmax(np.abs(pressure))) > NEAR_RELIEF * parameters.relief_pressure
    fit = fit_greybox(
        RELIEVING_FLOW_FORM if relieved else FLOW_FORM,
        np.column_stack([bridged(record[channel]) for channel in FLOW_FORM.drives]),
        pressure,
        parameter_row(parameters),
        record.sample_time,
        starts=_starts(parameters, max(bulk_modulus, 1e-2 * parameters.bulk_modulus)),
        variance=measurement_variances(record, ["differential_pressure_pa"])["differential_pressure_pa"],
        substeps=max(1, ceil(record.sample_time / LONGEST_STEP - 1e-9)),
    )
    return FlowFit(
        parameters={name: (value, value * fit.log_std[name]) for name, value in fit.values.items()},
        bound=fit.log_std["bulk_modulus"],
        chi_square=fit.chi_square,
        reasons=_objections(fit),
        residual=fit.residual,
    )


def _starts(p: EhaParameters, bulk_modulus: float) -> list[dict[str, float]]:
    leakage = max(p.leakage_coefficient, LEAST_LEAKAGE * p.pump_displacement * p.rated_speed / p.relief_pressure)
    bias = max(p.flow_bias, LEAST_LEAKAGE * p.pump_displacement * p.rated_speed)
    moduli = sorted({bulk_modulus, p.bulk_modulus})
    return [
        {
            "bulk_modulus": modulus,
            "leakage_coefficient": worse * leakage,
            "flow_bias": biased * bias,
            "makeup_conductance": makeup,
            "speed_lead": LEAD_START,
            "relief_pressure": p.relief_pressure,
            "relief_conductance": p.relief_conductance,
        }
        for worse, biased in FAULTS_TRIED
        for makeup in MAKEUP_TRIED
        for modulus in moduli
    ]


LEAST_LEAKAGE = 1e-3
"""Least first guess of a leakage, as a share of the rated pump flow [fraction]; a logarithm cannot start at zero."""


def _objections(fit: GreyBoxFit) -> tuple[str, ...]:
    reasons: list[str] = []
    if fit.chi_square > LARGEST_CHI_SQUARE:
        reasons.append(
            f"the pressure residuals are {fit.chi_square**0.5:.1f} times larger than the sensor's noise: "
            "the log does something that the flow balance does not know"
        )
    if abs(fit.autocorrelation) > LARGEST_AUTOCORRELATION:
        reasons.append(
            f"neighbouring pressure residuals are correlated by {fit.autocorrelation:.2f}: "
            "the log does something that the flow balance does not know"
        )
    return tuple(reasons)
