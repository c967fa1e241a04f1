"""`fit_motion(record, parameters, ...) -> FormFit`: bulk modulus, leakage and friction of a log without pressure."""

from collections.abc import Iterator, Mapping
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from estimation.fits.averaged import block_means, samples_a_block
from estimation.fits.descent import Point, descend, descend_together
from estimation.fits.flow_log import DRAIN_START, LEAST_LEAKAGE
from estimation.fits.flow_search import LEAD_START
from estimation.fits.force_scale import Way, disagree, rescaled
from estimation.fits.form_fit import FAULTS_TRIED, LONGEST_STEP, FormFit, weighed, with_structure
from estimation.fits.freed_problem import FreedProblem
from estimation.fits.greybox_fit import GreyBoxFit, concluded
from estimation.fits.greybox_log import GreyBoxLog, OutputNoise
from estimation.fits.greybox_problem import Problem, search_bounds
from estimation.log_checks.bridging import bridged
from estimation.log_checks.measurement_noise import measurement_variances, position_variance
from estimation.models.greybox import GreyBoxModel
from estimation.models.motion import LINEAR, MOTION_FORMS, UNKNOWNS, MotionParameters
from estimation.notes import EstimateCode
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.errors import LogError
from plant.log.record import Record
from plant.notes import Note
from plant.runs import steps_a_sample
from plant.solvers.steps import parameter_row

MOTION_CHANNELS = ("position_m",)
"""Channels that the motion form needs beside motor speed."""

FRICTION_TRIED = ((1.0, 1.0, 1.0), (18.0, -3.5, 1.15), (68.0, 8.7, 1.25))
"""Friction coefficients a_1, a_2, a_3 of the starts, as multiples of the healthy actuator's: the spread of Table 4."""

YIELDED = 2e-5
"""First guess of the deflection at which seals slide [m]; tens of micrometres in the literature on presliding."""

DAMPING_START = 100.0
"""First guess of the bristle's damping [N s/m]; small beside the oil's."""

FINEST_STEP = 6.25e-5
"""Longest step while the piston turns, yields or is set off [s]: the bristle's state passes through zero there."""

TURNING = 0.3
"""Speed under which it counts as turning, over the log's root mean square [fraction]."""

SET_OFF = 1.0
"""Change of motor speed between samples from which the pump counts as setting the piston off [rad/s]."""

SHORTEST_SAMPLE = 1e-3
"""Faster logs are averaged to about this sample time [s]: nothing that the model describes is quicker to see."""

MOST_SAMPLES = 30_000
"""A longer log is fitted on its beginning: the fit's interval is under a percent long before."""

SCREENED = 4_000
"""Samples on which starts are screened."""

SEARCHED = 10_000
"""Samples on which the likelier starts are carried on; a longer log goes on from where they end."""

UNCHANGED = (1.0, 1.0)
"""Factors that leave the noise as it is [dimensionless]."""

WAYS: tuple[tuple[tuple[float, float], tuple[float, float]], ...] = (
    ((1.0, 1e6), (1.0, 1e3)),
    (UNCHANGED, UNCHANGED),
    ((1e2, 1e6), (1.0, 1e3)),
)
"""Ways down to the optimum: factors on variance and random walk of the residual while starts are screened and while
they are brought near. With the true, small noise the least misfit of leakage piles up into the position and hides other
ways down; with a larger walk what counts is increments. Where the piston sticks, straight down is often the shorter."""

SCREENING, NEARING, FINISHING = 10, 12, 25
"""Evaluations of the model in the three stages."""

NEAR_ENOUGH = 0.01
"""Cost that a further step must promise while a start is only brought near [dimensionless]."""

FINALISTS = 3
"""Starts that are carried on each way, the likeliest of each way first, until one explains the log."""

EXPLAINED = 1.1
"""Mean squared normalised residual up to which a form explains the log [dimensionless]."""

STRUCTURE = 0.005
"""Relative standard deviation of bulk modulus from friction being of no known law: on the foreign bench, whose
presliding is of another make, noise alone explains a tenth to a half of the errors. Judged from that one bench
[fraction]."""

ALIKE = 5.0
"""Difference of log-likelihood up to which two structures are said to explain a log alike [dimensionless]."""


def fit_motion(
    record: Record,
    parameters: EhaParameters,
    bulk_modulus: float,
    uncertainties: Mapping[str, float] | None = None,
    variances: Mapping[str, float] | None = None,
) -> FormFit:
    """Fit the motion form to a log with either structure of friction, and weigh the two.

    Parameters
    ----------
    record : Record
        The log, with position; it begins at rest.
    parameters : EhaParameters
        Geometry, pump and mass are taken from it; leakage, flow bias and friction are first guesses.
    bulk_modulus : float
        First guess of effective bulk modulus [Pa].
    uncertainties : Mapping[str, float], optional
        Relative standard deviation of the actuator's parameters [fraction]; none by default.
    variances : Mapping[str, float], optional
        Measurement variance of motor speed [rad^2/s^2] by its name; read off the log if not given.

    Returns
    -------
    FormFit
        Value, deviations, and what speaks against them.

    Raises
    ------
    LogError
        If position is missing.
    """
    if "position_m" not in record:
        raise LogError("the motion form needs position_m, the record lacks it")
    noise = (variances or measurement_variances(record, ("motor_speed_rad_s",)))["motor_speed_rad_s"]
    log = _log(record, parameters, uncertainties or {}, noise)
    starts = _starts(parameters, max(bulk_modulus, 1e-2 * parameters.bulk_modulus))
    first, others = _searched(MOTION_FORMS[0], log, starts)
    second, more = _compared(MOTION_FORMS[1], log, first, starts)
    fits, others = [first, second], [*others, *more]
    best = min(fits, key=lambda fit: fit.cost)
    found = weighed(fits)
    value, std = found["bulk_modulus"]
    apart = max((abs(float(np.log(other / value))) for other in others), default=0.0)
    believed = with_structure(found, float(np.hypot(STRUCTURE, apart)))
    bound = float(np.hypot(std / value, apart))
    return FormFit(believed, bound, best.chi_square[0], _objections(fits, best, others), best.rig_slopes)


def _log(record: Record, p: EhaParameters, uncertainties: Mapping[str, float], speed_variance: float) -> GreyBoxLog:
    block = samples_a_block(record.sample_time, SHORTEST_SAMPLE)
    sample_time = block * record.sample_time
    speed, position = (block_means(record[name], block)[:MOST_SAMPLES] for name in ("motor_speed_rad_s", "position_m"))
    moved = bridged(position)
    drives = np.column_stack([bridged(speed), moved])
    drift = (p.pump_displacement / p.piston_area) ** 2 * speed_variance * record.sample_time
    return GreyBoxLog(
        drives=drives,
        measured=(position - moved[0])[:, None],
        parameters=parameter_row(MotionParameters(**{one.name: getattr(p, one.name) for one in fields(p)})),
        sample_time=sample_time,
        steps=_steps(drives, sample_time),
        noise=(OutputNoise(position_variance(record["position_m"]) / block, drift),),
        uncertainties=uncertainties,
    )


def _steps(drives: Array, sample_time: float) -> NDArray[np.int64]:
    """Return the model steps up to each sample: short ones where the piston turns or is set off."""
    reach = max(1, round(5e-3 / sample_time))
    sums = np.cumsum(np.pad(drives[:, 1] - drives[0, 1], (reach + 1, reach), mode="symmetric"))
    smooth = (sums[2 * reach + 1 :] - sums[: -2 * reach - 1]) / (2 * reach + 1)
    velocity = np.gradient(smooth) / sample_time
    turning = np.abs(velocity) < TURNING * np.sqrt(np.mean(velocity**2))
    set_off = np.abs(np.diff(drives[:, 0], prepend=drives[0, 0])) > SET_OFF
    fine, coarse = (steps_a_sample(sample_time, step) for step in (FINEST_STEP, LONGEST_STEP))
    return np.where(turning | set_off, fine, coarse)


def _starts(p: EhaParameters, bulk_modulus: float) -> list[dict[str, float]]:
    healthy = EhaParameters()
    leakage = max(p.leakage_coefficient, LEAST_LEAKAGE * p.pump_displacement * p.rated_speed / p.relief_pressure)
    bias = max(p.flow_bias, LEAST_LEAKAGE * p.pump_displacement * p.rated_speed)
    quadratic = p.friction_quadratic or healthy.friction_quadratic
    coulomb = p.friction_coulomb or healthy.friction_coulomb
    return [
        {
            "bulk_modulus": bulk_modulus,
            "leakage_coefficient": worse * leakage,
            "flow_bias": biased * bias,
            "makeup_conductance": p.makeup_conductance or healthy.makeup_conductance,
            "case_leakage": DRAIN_START * leakage,
            "speed_lead": LEAD_START,
            "friction_quadratic": a1 * quadratic,
            "friction_linear": a2 * p.friction_linear,
            "friction_coulomb": a3 * coulomb,
            "bristle_stiffness": a3 * coulomb / YIELDED,
            "bristle_damping": DAMPING_START,
        }
        for worse, biased in FAULTS_TRIED
        for a1, a2, a3 in FRICTION_TRIED
    ]


def _searched(form: GreyBoxModel, log: GreyBoxLog, starts: list[dict[str, float]]) -> tuple[GreyBoxFit, list[float]]:
    """Return the best of several starts, and other bulk moduli that explain the log; stop at a start that does."""
    whole = FreedProblem(form, log, UNKNOWNS, LINEAR)
    part = whole.on(log.beginning(SEARCHED))
    explained = 0.5 * EXPLAINED * len(part.log.measured)
    guesses, bounds = _guesses(whole, starts)
    best, others = part.at(guesses[0]), list[float]()
    for near in _brought_near(part, guesses, bounds, explained):
        best = min(best, descend(part.at, near, FINISHING, bounds), key=lambda point: point.cost)
        if best.cost < explained:
            near = part.on(part.log.softened(*WAYS[0][1]))
            best, others = rescaled(part, best, Way(near, NEARING, NEAR_ENOUGH, FINISHING, bounds, explained))
            break
    if len(part.log.measured) < len(log.measured):
        best = descend(whole.at, best.theta, FINISHING, bounds)
    return concluded(whole, best), others


def _guesses(problem: Problem, starts: list[dict[str, float]]) -> tuple[list[Array], tuple[Array, Array]]:
    """Return the starts in fitted coordinates, and how far a search from them may go."""
    guesses = [problem.model.theta(start) for start in starts]
    return guesses, search_bounds(problem.model, guesses, {"speed_lead": (0.0, 0.5 * problem.log.sample_time)})


def _brought_near(
    whole: FreedProblem, guesses: list[Array], bounds: tuple[Array, Array], explained: float
) -> Iterator[Array]:
    """Yield the likelier starts, brought nearer: the likeliest of each way, then the next.

    One whose misfit is over what explains the log with the larger noise too is left out.
    """
    screened: dict[int, list[Point]] = {}
    for rank in range(FINALISTS):
        for way, (first, second) in enumerate(WAYS):
            if way not in screened:
                screen = whole.on(whole.log.softened(*first).beginning(SCREENED))
                points = descend_together(screen.at_each, guesses, SCREENING, bounds, NEAR_ENOUGH)
                screened[way] = sorted(points, key=lambda point: point.cost)
            near = whole.on(whole.log.softened(*second))
            reached = descend(near.at, screened[way][rank].theta, NEARING, bounds, NEAR_ENOUGH)
            if reached.cost < explained or second == UNCHANGED:
                yield reached.theta


def _compared(
    form: GreyBoxModel, log: GreyBoxLog, other: GreyBoxFit, starts: list[dict[str, float]]
) -> tuple[GreyBoxFit, list[float]]:
    """Return the fit of the other structure: from where the first ended, or by itself where that explains nothing."""
    if other.chi_square[0] > EXPLAINED:
        return _searched(form, log, starts)
    whole = FreedProblem(form, log, UNKNOWNS, LINEAR)
    _, bounds = _guesses(whole, starts)
    return concluded(whole, descend(whole.at, other.theta, NEARING, bounds)), []


def _objections(fits: list[GreyBoxFit], best: GreyBoxFit, others: list[float]) -> tuple[Note, ...]:
    reasons: list[Note] = []
    if best.chi_square[0] > EXPLAINED:
        reasons.append(EstimateCode.POSITION_RESIDUALS_LARGE.note(ratio=best.chi_square[0] ** 0.5))
    values = [fit.values["bulk_modulus"] for fit in fits if fit.cost < best.cost + ALIKE]
    if disagree(values):
        reasons.append(EstimateCode.FRICTION_LAWS_DISAGREE.note(least_pa=min(values), most_pa=max(values)))
    scales = [*others, best.values["bulk_modulus"]]
    if disagree(scales):
        reasons.append(EstimateCode.FORCES_ON_ANY_SCALE.note(least_pa=min(scales), most_pa=max(scales)))
    return tuple(reasons)
