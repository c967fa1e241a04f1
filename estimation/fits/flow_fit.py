"""`fit_flow(record, parameters, ...) -> FormFit`: bulk modulus, leakage and flow bias of a log, by the flow form."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from estimation.fits.averaged import averaged
from estimation.fits.descent import Point, descend
from estimation.fits.explain import WORTH, explain, promised
from estimation.fits.form_fit import FAULTS_TRIED, LONGEST_STEP, FormFit, weighed, with_structure
from estimation.fits.freed_problem import FreedProblem
from estimation.fits.greybox_fit import GreyBoxFit, Search, concluded, roughly
from estimation.fits.greybox_log import GreyBoxLog, greybox_log
from estimation.fits.greybox_problem import Problem
from estimation.fits.hypotheses import DELIVERY, HYPOTHESES, LEAST_DELIVERY, OFFSET, START_LOAD, Hypothesis
from estimation.fits.wide_problem import flow_bounds
from estimation.log_checks.bridging import bridged, gaps
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.log_checks.outliers import without_outliers
from estimation.models.flow import (
    FLOW_FORM,
    HELD_FLOW_FORM,
    MASS_FLOW_FORM,
    STIFFNESS,
    flow_parameters,
    reaches_relief,
    relieving,
)
from estimation.models.greybox import GreyBoxModel
from estimation.notes import EstimateCode
from plant.eha.model import EhaParameters
from plant.errors import LogError
from plant.log.record import Record
from plant.notes import Note
from plant.spare_processors import each

Array = NDArray[np.float64]
Bounds: TypeAlias = tuple[Array, Array]

FLOW_CHANNELS = ("position_m", "differential_pressure_pa")
"""Channels that the flow form needs beside motor speed."""

REPORTED = ("leakage_coefficient", "flow_bias")
"""What is worth telling of the parameters found along with bulk modulus."""

MAKEUP_TRIED = (1e-9, 1e-13)
"""Make-up conductances of the starts [m^3/(s Pa)]: a circuit with make-up valves, and one without."""

LEAD_START = 1e-5
"""First guess of the motor's lead on the straight line between samples [s]."""

OPENING_START = 1e3
"""First guess of the drop at which a make-up check valve is half open [Pa]."""

DRAIN_START = 0.05
"""First guess of the pump's case drain, as a share of the healthy leakage [fraction]."""

PRESUMED_STD = 1.0
"""Standard deviation of the logarithms of the last two about their first guesses, before the log is seen: where the
make-up valves never open, no log tells a drain from leakage, and any drain would do [dimensionless]."""

SCREENED_SECONDS = 4.0
"""Starts are compared on the beginning of the log: it tells a wrong valley from a right one [s]."""

FINISHING = 15
"""Evaluations with short model steps: what is not there by then is a conductance that vanishes, a little at a time."""

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

MOST_ASKED = 50_000
"""A longer log is not asked what is strange about it: the answer takes minutes [samples]."""

STRUCTURE = 5e-4
"""Relative standard deviation of bulk modulus from what the balance leaves out. Judged on 18 plain logs of the open
benchmark's validation split, where z is 1.14 rms without it and 0.95 with it [fraction]."""

UNLIKELY = 36.0
"""Difference of log-likelihood from which a form of the balance counts for nothing beside the other [dimensionless]."""


def fit_flow(
    record: Record,
    parameters: EhaParameters,
    bulk_modulus: float,
    uncertainties: Mapping[str, float] | None = None,
    variances: Mapping[str, float] | None = None,
    *,
    loaded: bool = False,
) -> FormFit:
    """Fit the flow form to a log, balanced by volume, by mass, and by volume in held chambers, and weigh the three.

    A log that it does not explain is asked what is strange about rig, oil or logger (`estimation.fits.explain`).
    Gross outliers are taken out, and what the pump delivered while its speed is missing is read off the pressure after.

    Parameters
    ----------
    record : Record
        The log, with position and differential pressure.
    parameters : EhaParameters
        Geometry and pump are taken from it; leakage and flow bias are first guesses.
    bulk_modulus : float
        First guess of effective bulk modulus [Pa].
    uncertainties : Mapping[str, float], optional
        Relative standard deviation of the actuator's parameters [fraction]; none by default.
    variances : Mapping[str, float], optional
        Measurement variances of the channels of a log whose gross outliers are missing already [SI squared]; both are
        done here if not given.
    loaded : bool
        Whether the log begins under load, and not at rest.

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
    if variances is None:
        record, variances = _cleaned(record)
    log = _log(record, parameters, uncertainties or {}, variances)
    starts = _starts(parameters, max(bulk_modulus, 1e-2 * parameters.bulk_modulus))
    fits = _balanced(log, parameters, starts)
    best, found = min(fits, key=_cost), weighed(fits)
    swinging = min((fit for fit in fits if fit.model.rates is not HELD_FLOW_FORM.rates), key=_cost)
    if asked := _asked(log, parameters, swinging, loaded=loaded):
        strange = explain(log, parameters, _near(swinging, starts), _explains, asked=asked, paired=asked != (DELIVERY,))
        one = strange.fit
        if _explains(one) and one.cost < best.cost - WORTH:
            bound = one.std["bulk_modulus"] / one.values["bulk_modulus"]
            believed = with_structure(strange.values, STRUCTURE)
            return FormFit(believed, bound, one.chi_square[0], (), one.rig_slopes, strange)
    value, std = found["bulk_modulus"]
    believed = with_structure(found, STRUCTURE)
    return FormFit(believed, std / value, best.chi_square[0], _objections(best), best.rig_slopes)


def _balanced(
    log: GreyBoxLog, parameters: EhaParameters, starts: Sequence[Mapping[str, float]]
) -> Sequence[GreyBoxFit]:
    """Return the fits of the balances that count, the first by volume."""
    relieved = reaches_relief(log.measured, parameters.relief_pressure)
    forms = [relieving(form) if relieved else form for form in (FLOW_FORM, MASS_FLOW_FORM, HELD_FLOW_FORM)]
    search = Search(screened=ceil(SCREENED_SECONDS / log.sample_time))

    def sought(form: GreyBoxModel, tried: Sequence[Mapping[str, float]]) -> tuple[Problem, Point, Bounds]:
        problem = Problem(form, log) if log.gaps.size else FreedProblem.of(form, log)  # what gaps leave open, once
        guesses = [form.theta({STIFFNESS: 0.0, **start}) for start in tried]
        bounds = flow_bounds(form, guesses, log)
        return problem, roughly(problem, guesses, search, bounds), bounds

    first = sought(forms[0], starts)
    near = [{STIFFNESS: 0.0, **first[0].model.values(first[1].theta)}]
    rough = [first, *each(lambda form: sought(form, near), forms[1:])]
    least = min(point.cost for _, point, _ in rough)
    likely = [  # twice what counts: long model steps have errors
        one for one in rough if one is first or one[1].cost < least + 2.0 * UNLIKELY
    ]

    def finished(one: tuple[Problem, Point, Bounds]) -> tuple[Problem, Point]:
        problem, point, bounds = one
        return problem, descend(problem.at, point.theta, FINISHING, bounds)

    done = each(finished, likely)
    least = min(point.cost for _, point in done)
    return each(lambda one: concluded(*one, disturbed=one[1].cost < least + UNLIKELY), done)


def _asked(log: GreyBoxLog, parameters: EhaParameters, swinging: GreyBoxFit, *, loaded: bool) -> tuple[Hypothesis, ...]:
    """Return what a log is asked beside the plain form, given its likelier fit with volumes that swing.

    Held volumes may explain a log whose encoder was homed elsewhere: it is asked all the same.
    """
    if len(log.drives) > MOST_ASKED:
        return ()
    if loaded:  # a sensor that reads too much looks loaded at rest
        return (START_LOAD, OFFSET)
    if not _explains(swinging):
        return HYPOTHESES
    gain, size = promised(log, parameters, swinging.values, DELIVERY)
    return (DELIVERY,) if gain > WORTH and size > LEAST_DELIVERY else ()


def _near(fit: GreyBoxFit, starts: Sequence[Mapping[str, float]]) -> Sequence[Mapping[str, float]]:
    """Return where the search for what is strange begins: a fit that explains the log is in no wrong valley."""
    if _explains(fit):
        return [fit.values]
    usual = [start for start in starts if start["makeup_conductance"] == MAKEUP_TRIED[0]]
    return [{name: value for name, value in fit.values.items() if name != STIFFNESS}, *usual]


def _cost(fit: GreyBoxFit) -> float:
    return fit.cost


def _explains(fit: GreyBoxFit) -> bool:
    return not _objections(fit)


def _cleaned(record: Record) -> tuple[Record, Mapping[str, float]]:
    """Return the channels of the flow form without gross outliers, and their variances."""
    channels = (*FLOW_FORM.drives, *FLOW_FORM.outputs)
    noise = measurement_variances(record, channels)
    sound = {name: without_outliers(record[name], noise[name] ** 0.5) for name in channels}
    record = Record(record.sample_time, sound, start_time=record.start_time)
    return record, measurement_variances(record, channels)


def speed_gaps(record: Record, parameters: EhaParameters, noise: float) -> Array:
    """Return where missing motor speeds leave the pumped volume open by more than the pressure can overlook.

    Parameters
    ----------
    record : Record
        The log.
    parameters : EhaParameters
        The actuator.
    noise : float
        Standard deviation of the differential pressure's noise [Pa].

    Returns
    -------
    ndarray, shape (gaps, 3)
        As `GreyBoxLog.gaps`, in pressure [Pa squared].
    """
    missing = np.isnan(record["motor_speed_rad_s"])
    first, after = np.flatnonzero(np.diff(missing, prepend=False, append=False)).reshape(-1, 2).T
    speed, last, length = bridged(record["motor_speed_rad_s"]), len(missing) - 1, after - first
    before, further, behind = np.maximum(first - 1, 0), np.maximum(first - 2, 0), np.minimum(after, last)
    # a straight line is right where the speed goes on as it did before the gap and does after it
    slopes = 0.5 * (speed[before] - speed[further] + speed[np.minimum(after + 1, last)] - speed[behind])
    sudden = np.abs(speed[behind] - speed[before] - slopes * (length + 1))
    sudden = np.where(length < LONG_GAP, sudden, np.maximum(sudden, np.std(speed)))
    stiffness = parameters.bulk_modulus / parameters.chamber_volume * parameters.pump_displacement
    open_by = 0.5 * stiffness * sudden * length * record.sample_time
    open_gaps = np.array([first, behind, open_by**2 / (length + 1)], dtype=np.float64)
    return np.ascontiguousarray(open_gaps[:, open_by > FELT_GAP * noise].T)


def _log(
    record: Record, parameters: EhaParameters, uncertainties: Mapping[str, float], variances: Mapping[str, float]
) -> GreyBoxLog:
    log = greybox_log(
        FLOW_FORM,
        record,
        flow_parameters(parameters),
        longest_step=LONGEST_STEP,
        variances=variances,
        uncertainties=uncertainties,
    )
    log = replace(
        log,
        # where the piston is within a gap of its position is not known, where it is after it is
        measured=np.where(_within_gaps(record["position_m"])[:, None], np.nan, log.measured),
        gaps=speed_gaps(record, parameters, variances["differential_pressure_pa"] ** 0.5),
        presumed={
            "case_leakage": (DRAIN_START * _usual_leakage(parameters), PRESUMED_STD),
            "makeup_opening": (OPENING_START, PRESUMED_STD),
        },
    )
    return averaged(log, LONGEST_STEP)


def _within_gaps(position: Array) -> NDArray[np.bool_]:
    """Return the samples in gaps of the position, and before its first and after its last."""
    present = np.flatnonzero(np.isfinite(position))
    apart, wide = gaps(position)
    within = np.isnan(position)
    within[present[0] : present[-1]] &= np.repeat(wide, apart.astype(np.int64))
    return within


def _usual_leakage(p: EhaParameters) -> float:
    return max(p.leakage_coefficient, LEAST_LEAKAGE * p.pump_displacement * p.rated_speed / p.relief_pressure)


def _starts(p: EhaParameters, bulk_modulus: float) -> list[dict[str, float]]:
    leakage = _usual_leakage(p)
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


def _objections(fit: GreyBoxFit) -> tuple[Note, ...]:
    reasons: list[Note] = []
    if fit.chi_square[0] > LARGEST_CHI_SQUARE:
        reasons.append(EstimateCode.PRESSURE_RESIDUALS_LARGE.note(ratio=fit.chi_square[0] ** 0.5))
    if abs(fit.autocorrelation[0]) > LARGEST_AUTOCORRELATION:
        reasons.append(EstimateCode.PRESSURE_RESIDUALS_CORRELATED.note(correlation=fit.autocorrelation[0]))
    return tuple(reasons)
