"""`fit_flow(record, parameters, ...) -> FormFit`: bulk modulus, leakage and flow bias of a log, by the flow form."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from estimation.flow import FLOW_FORM, MASS_FLOW_FORM, relieving
from estimation.form_fit import LONGEST_STEP, FormFit, weighed
from estimation.greybox_fit import GreyBoxFit, Search, fit_greybox
from estimation.greybox_problem import GreyBoxLog, OutputNoise, Problem
from estimation.identification.preprocess import bridged
from estimation.measurement_noise import measurement_variances
from estimation.outliers import without_outliers
from plant.eha import EhaParameters
from plant.errors import LogError
from plant.integrate import parameter_row
from plant.record import Record

Array = NDArray[np.float64]

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

OPENING_START = 1e3
"""First guess of the drop at which a make-up check valve is half open [Pa]."""

DRAIN_START = 0.05
"""First guess of the pump's case drain, as a share of the healthy leakage [fraction]."""

SCREENED_SECONDS = 4.0
"""Starts are compared on the beginning of the log: it tells a wrong valley from a right one [s]."""

NEAR_RELIEF = 0.97
"""Share of the relief setting above which the valve is taken to open [fraction]."""

LARGEST_CHI_SQUARE = 1.2
"""Mean squared normalised residual above which the model is said to leave something out [dimensionless]."""

LARGEST_AUTOCORRELATION = 0.1
"""Correlation of neighbouring residuals above which the same is said [dimensionless]."""

LEAST_LEAKAGE = 1e-3
"""Least first guess of a leakage, as a share of the rated pump flow [fraction]; a logarithm cannot start at zero."""

LONG_GAP = 5
"""Missing speeds in a row after which nothing is concluded from the speeds at the gap's ends [samples]."""

FELT_GAP = 0.1
"""A gap in speed matters where what it leaves open moves pressure by this share of its noise or more [fraction]."""

REFILLS = 3
"""How often the flow within gaps is found from the pressure after them."""


def fit_flow(
    record: Record,
    parameters: EhaParameters,
    bulk_modulus: float,
    uncertainties: Mapping[str, float] | None = None,
) -> FormFit:
    """Fit the flow form to a log, balanced by volume and by mass, and weigh the two.

    Gross outliers are taken out, and what the pump delivered while its speed is missing follows from the pressure.

    Parameters
    ----------
    record : Record
        The log, with position and differential pressure; it begins at rest.
    parameters : EhaParameters
        Geometry and pump are taken from it; leakage and flow bias are first guesses.
    bulk_modulus : float
        First guess of effective bulk modulus [Pa].
    uncertainties : Mapping[str, float], optional
        Relative standard deviation of the actuator's parameters [fraction]; none by default.

    Returns
    -------
    FormFit
        The best of several starts.

    Raises
    ------
    LogError
        If a channel is missing.
    """
    lacking = [channel for channel in FLOW_CHANNELS if channel not in record]
    if lacking:
        raise LogError(f"the flow form needs {' and '.join(FLOW_CHANNELS)}, the record lacks {', '.join(lacking)}")
    noise = measurement_variances(record, (*FLOW_FORM.drives, *FLOW_FORM.outputs))
    sound = {name: without_outliers(record[name], variance**0.5) for name, variance in noise.items()}
    record = Record(record.sample_time, sound, start_time=record.start_time)
    pressure = record["differential_pressure_pa"]
    relieved = float(np.nanmax(np.abs(pressure))) > NEAR_RELIEF * parameters.relief_pressure
    forms = [relieving(form) if relieved else form for form in (FLOW_FORM, MASS_FLOW_FORM)]
    log = _log(record, parameters, uncertainties or {})
    starts = _starts(parameters, max(bulk_modulus, 1e-2 * parameters.bulk_modulus))
    search = Search(screened=ceil(SCREENED_SECONDS / record.sample_time))
    ceilings = {"speed_lead": record.sample_time}
    gaps = speed_gaps(record, parameters)
    by_volume = fit_greybox(forms[0], log, starts=starts, search=search, ceilings=ceilings)
    for number in range(REFILLS if len(gaps) else 0):
        log = refilled(log, by_volume, gaps)
        # a fit to a gap's wrong flow may lie in a wrong valley, so all starts are tried again when that is nearly right
        tried = [by_volume.values, *(starts if number == REFILLS - 2 else [])]
        by_volume = fit_greybox(forms[0], log, starts=tried, search=search, ceilings=ceilings)
    by_mass = fit_greybox(forms[1], log, starts=[_restarted(by_volume, starts)], ceilings=ceilings)
    best = min((by_volume, by_mass), key=lambda fit: fit.cost)
    found, rig_std = weighed((by_volume, by_mass))
    value, std = found["bulk_modulus"]
    return FormFit(found, rig_std, std / value, best.chi_square[0], _objections(best))


def speed_gaps(record: Record, parameters: EhaParameters) -> Array:
    """Return where missing motor speeds leave the pumped volume open by more than the pressure can overlook.

    Parameters
    ----------
    record : Record
        The log.
    parameters : EhaParameters
        The actuator.

    Returns
    -------
    ndarray, shape (gaps, n)
        For each such gap, one in it and zero elsewhere [dimensionless].
    """
    speed = record["motor_speed_rad_s"]
    bounds = np.flatnonzero(np.diff(np.isnan(speed).astype(np.int8), prepend=0, append=0)).reshape(-1, 2)
    noise = measurement_variances(record, ("differential_pressure_pa",))["differential_pressure_pa"] ** 0.5
    stiffness = parameters.bulk_modulus / parameters.chamber_volume * parameters.pump_displacement
    usual = float(np.median(np.diff(np.flatnonzero(np.isfinite(speed)))))  # more than 1 for a slow sensor
    bumps: list[Array] = []
    for first, after in bounds:
        length = after - first
        if first < 2 or after > len(speed) - 2:
            continue
        # a straight line is right where the speed goes on as it did before the gap and does after it
        slopes = np.nan_to_num([speed[first - 1] - speed[first - 2], speed[after + 1] - speed[after]])
        sudden = abs(speed[after] - speed[first - 1] - np.mean(slopes) * (length + 1))
        felt = 0.5 * stiffness * sudden * length * record.sample_time > FELT_GAP * noise
        if felt or length >= LONG_GAP * usual:
            bumps.append(np.zeros(len(speed)))
            bumps[-1][first:after] = 1.0
    return np.array(bumps)


def refilled(log: GreyBoxLog, fit: GreyBoxFit, bumps: Array) -> GreyBoxLog:
    """Return the log with the speed in its gaps such that the pressure after them is explained.

    Parameters
    ----------
    log : GreyBoxLog
        The log, gaps bridged.
    fit : GreyBoxFit
        A fit to it.
    bumps : ndarray, shape (gaps, n)
        The gaps, of `speed_gaps` [dimensionless].

    Returns
    -------
    GreyBoxLog
        The log, its speed changed by a Gauss-Newton step of the gaps' mean speeds beside the unknowns.
    """
    problem = Problem(fit.model, log)
    errors, slopes = problem.predict(tuple(fit.theta))
    predicted, _ = problem.run(fit.theta)
    unit = np.zeros_like(log.drives)
    responses: list[Array] = []
    for bump in bumps:
        unit[:, 0] = bump
        responses.append(problem.normalised(problem.run(fit.theta, drives=log.drives + unit)[0] - predicted))
    columns = np.column_stack([slopes, *responses])
    size = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    step = np.linalg.lstsq(columns / size, -errors, rcond=None)[0] / size
    drives = log.drives.copy()
    drives[:, 0] += step[slopes.shape[1] :] @ bumps
    return replace(log, drives=drives)


def _log(record: Record, parameters: EhaParameters, uncertainties: Mapping[str, float]) -> GreyBoxLog:
    channels = (*FLOW_FORM.drives, *FLOW_FORM.outputs)
    variances = measurement_variances(record, channels)
    return GreyBoxLog(
        drives=np.column_stack([bridged(record[channel]) for channel in FLOW_FORM.drives]),
        measured=record["differential_pressure_pa"][:, None],
        parameters=parameter_row(parameters),
        sample_time=record.sample_time,
        steps=np.full(len(record), max(1, ceil(record.sample_time / LONGEST_STEP - 1e-9))),
        noise=(OutputNoise(variances["differential_pressure_pa"]),),
        drive_std=tuple(variances[channel] ** 0.5 for channel in FLOW_FORM.drives),
        uncertainties=uncertainties,
    )


def _restarted(fit: GreyBoxFit, starts: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Return what was found; what vanished has no slope to come back on, so it begins at its first guess again."""
    return dict(fit.values) | {name: starts[0][name] for name in ("case_leakage", "makeup_opening", "speed_lead")}


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
            "makeup_opening": OPENING_START,
            "case_leakage": DRAIN_START * leakage,
            "speed_lead": LEAD_START,
            "relief_pressure": p.relief_pressure,
            "relief_conductance": p.relief_conductance,
        }
        for worse, biased in FAULTS_TRIED
        for makeup in MAKEUP_TRIED
        for modulus in moduli
    ]


def _objections(fit: GreyBoxFit) -> tuple[str, ...]:
    reasons: list[str] = []
    if fit.chi_square[0] > LARGEST_CHI_SQUARE:
        reasons.append(
            f"the pressure residuals are {fit.chi_square[0] ** 0.5:.1f} times larger than the sensor's noise: "
            "the log does something that the flow balance does not know"
        )
    if abs(fit.autocorrelation[0]) > LARGEST_AUTOCORRELATION:
        reasons.append(
            f"neighbouring pressure residuals are correlated by {fit.autocorrelation[0]:.2f}: "
            "the log does something that the flow balance does not know"
        )
    return tuple(reasons)
