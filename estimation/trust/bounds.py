"""Limit of any estimator: the posterior Cramér-Rao bound of every state along a drive."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import NamedTuple, TypeAlias

import numpy as np

from estimation.arrays import Array
from estimation.engine.kalman import belief_symbols, bounded_mean, predicted_outputs, scaled_step, total
from estimation.engine.parts import data_places, function_source
from estimation.filters.run import TRACK_ROWS
from estimation.log_checks.bridging import bridged
from estimation.models.eha_forms import BULK_MODULUS
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.compiled.expression import ONE, ZERO, jacobian, symbol
from plant.compiled.native.load import NativeKernel, load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text, kernel_text
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.solvers.steps import Parameters, parameter_row

FINEST_STEP = 1e-4
"""Step of the model along the trajectory; shorter if the log is sampled faster [s]."""


@dataclass(frozen=True, eq=False)
class Bound:
    """The posterior Cramér-Rao bound along a run.

    Parameters
    ----------
    time : ndarray, shape (rows,)
        Times of the track [s].
    mean : ndarray, shape (rows, n)
        The trajectory along which the bound was taken [SI].
    std : ndarray, shape (rows, n)
        Least standard deviation of every state [SI]; infinite if the model's own run diverges.
    belief : Gaussian or None
        Trajectory's end and least covariance there [SI]; None if the run diverges.
    """

    model: ProcessModel
    time: Array
    mean: Array
    std: Array
    belief: Gaussian | None

    def track(self, state: str) -> Array:
        """Return the bound of one state along the run.

        Returns
        -------
        ndarray, shape (rows,)
            Least standard deviation [the state's unit].
        """
        return self.std[:, self.model.index(state)]


def posterior_bound(
    model: ProcessModel,
    prior: Gaussian,
    record: Record,
    parameters: Parameters,
    *,
    variances: Mapping[str, float],
    noise: Mapping[str, float] | None = None,
) -> Bound:
    """Return the least covariance with which this drive and these sensors can determine the states.

    The bound's recursion (Tichavský, Muravchik and Nehorai 1998, equation 21) is that of the extended Kalman filter's
    covariance, taken along the true trajectory: here the model's own noiseless run from the prior's mean under the
    record's drive. A parameter that is a state, of `estimation.models.augment` or user-defined, has its bound too.
    While the piston sticks, position and velocity contain nothing about bulk modulus (errata E13).

    Parameters
    ----------
    prior : Gaussian
        True state at the first sample, and how well it is known then [SI]; a variance of 0 is exact knowledge.
    record : Record
        The drive, on its clock; its measurements are not used.
    variances : Mapping[str, float]
        Variance of each channel measured [SI squared].
    noise : Mapping[str, float], optional
        Process-noise densities that replace the model's, by state name [SI squared per second]; for a logarithmic
        state, those of the logarithm [1/s].

    Raises
    ------
    HydrostateError
        If the model does not predict a channel, or a variance is not positive.
    LogError
        If the record lacks a drive.
    """
    model.require_drives(record)
    for channel, variance in variances.items():
        if not variance > 0.0:
            raise HydrostateError(f"the variance of {channel} must be positive, got {variance}")
    scaled = model.to_filter(prior)
    substeps = max(model.substeps(record.sample_time), round(record.sample_time / FINEST_STEP))
    every = max(1, len(record) // TRACK_ROWS)
    rows = (len(record) - 1) // every + 1
    mean, std = np.empty((rows, model.width)), np.empty((rows, model.width))
    h = record.sample_time / substeps
    told = model.noise_densities(noise) * record.sample_time / substeps, np.array([*variances.values()], np.float64)
    drives = np.column_stack([bridged(record[drive]) for drive in model.drives])
    course = Course(drives, parameter_row(parameters, model.parameters), h, substeps, every)
    run_kernel = _compile(model, tuple(variances)).run
    covariance = run_kernel(scaled.mean.copy(), scaled.covariance.copy(), *told, course, mean, std)
    physical, slope = model.to_si(mean)
    finite = bool(np.all(np.isfinite(physical)) and np.all(np.isfinite(covariance)))
    spread = np.outer(slope[-1], slope[-1])
    return Bound(
        model=model,
        time=record.start_time + record.sample_time * every * np.arange(rows, dtype=np.float64),
        mean=physical,
        std=np.where(np.isfinite(std * slope), std * slope, np.inf),
        belief=Gaussian(physical[-1], covariance * spread) if finite else None,
    )


Move: TypeAlias = Callable[[Array, Array, Array, Array, float, float, float, Array], None]
"""``move(state, parameters, before, after, j, h, share, F)``: take sub-step j, and store the nonzero entries of its
Jacobian in F."""

Times: TypeAlias = Callable[[Array, Array, Array, int], None]
"""``left(F, P, FP, c)`` and ``right(F, FP, P, c)``: column c of ``F P``, and row c of ``FP F'``."""

Look: TypeAlias = Callable[[Array, Array, Array], None]
"""``look(state, parameters, H)``: derivative of each channel by the state."""


class Course(NamedTuple):
    """The run of the model along which a bound is taken.

    Parameters
    ----------
    drives : ndarray, shape (n, drives)
        Drives at the samples [SI].
    parameters : ndarray, shape (parameters,)
        The actuator's parameter row.
    h : float
        Length of a step [s].
    substeps, every : int
        Steps for each sample, and samples for each row of the track.
    """

    drives: Array
    parameters: Array
    h: float
    substeps: int
    every: int


def run(
    state: Array,
    P: Array,
    noise: Array,
    variances: Array,
    course: Course,
    track: Array,
    deviations: Array,
    *,
    WIDTH: int,
    SLOPES: int,
    move: Move,
    left: Times,
    right: Times,
    look: Look,
) -> Array:
    """Carry a covariance along the model's own run: through each step, then through the update by each channel.

    Parameters
    ----------
    state : ndarray, shape (states,)
        Initial state of the model, in its scaled units.
    P : ndarray, shape (states, states)
        Its covariance, updated in place.
    noise : ndarray, shape (states,)
        Variance that process noise adds in a step.
    variances : ndarray, shape (channels,)
        Variances of the channels [SI squared].
    track, deviations : ndarray, shape (rows, states)
        Output for the states and their deviations.
    """
    drives, parameters, h, substeps, every = course
    F, FP, H, PH = np.empty(SLOPES), np.empty((WIDTH, WIDTH)), np.zeros((len(variances), WIDTH)), np.empty(WIDTH)
    for k in range(drives.shape[0]):
        if k > 0:
            for j in range(substeps):
                move(state, parameters, drives[k - 1], drives[k], float(j), h, 1.0 / substeps, F)
                for c in range(WIDTH):
                    left(F, P, FP, c)
                for c in range(WIDTH):
                    right(F, FP, P, c)
                for c in range(WIDTH):
                    P[c, c] += noise[c]
        look(state, parameters, H)
        for c in range(len(variances)):
            reduce_by_channel(P, H[c], variances[c], PH, WIDTH=WIDTH)
        if k % every == 0:
            track[k // every] = state
            for c in range(WIDTH):
                deviations[k // every, c] = math.sqrt(max(P[c, c], 0.0))
    return P


def reduce_by_channel(P: Array, H: Array, variance: float, PH: Array, *, WIDTH: int) -> None:
    """Reduce a covariance by the information of a channel, as a Kalman filter does."""
    shown = 0.0
    for c in range(WIDTH):
        PH[c] = 0.0
        for k in range(WIDTH):
            PH[c] += H[k] * P[k, c]
    for c in range(WIDTH):
        shown += H[c] * PH[c]
    weight = 1.0 / (shown + variance)
    for c in range(WIDTH):
        for d in range(c, WIDTH):
            P[c, d] -= PH[c] * PH[d] * weight
            P[d, c] = P[c, d]


@cache
def _compile(model: ProcessModel, channels: tuple[str, ...]) -> NativeKernel:
    """Generate the recursion: the step and its Jacobian unrolled, the covariance in loops over nonzero entries.

    Unrolled as a whole, as the filters are, thirteen states take a compiler a minute.
    """
    n, every = model.width, range(model.width)
    mean, _ = belief_symbols(model)
    stepped, F = scaled_step(model)
    H = jacobian(predicted_outputs(model, mean, channels), mean)
    moving = [i for i in every if any(F[i][k] is not (ONE if i == k else ZERO) for k in every)]
    slopes = {f"F{i}_{k}": F[i][k] for i in moving for k in every if F[i][k] is not ZERO}
    state = {f"z{i}": f"state[{i}]" for i in every}
    reads = state | data_places(model, channels)
    reads |= {field.name: f"parameters[{i}]" for i, field in enumerate(fields(model.parameters))}
    kept = {name: f"F[{i}]" for i, name in enumerate(slopes)}
    moved = slopes | {f"z{i}": z for i, z in enumerate(bounded_mean(model, stepped))}
    product = {
        f"m{i}": total([symbol(f"F{i}_{k}") * symbol(f"x{k}") for k in every if F[i][k] is not ZERO])
        if i in moving
        else symbol(f"x{i}")
        for i in every
    }

    def times(name: str, arguments: str, source: str, target: str) -> str:
        read = kept | {f"x{k}": source.format(k) for k in every}
        return function_source(name, arguments, read, product, {f"m{i}": target.format(i) for i in every})

    seen = {f"H{c}_{k}": H[c][k] for c in range(len(channels)) for k in every if H[c][k] is not ZERO}
    shown = {name: f"H[{name[1:].replace('_', ', ')}]" for name in seen}
    parts = (
        function_source("move", "state, parameters, before, after, j, h, share, F", reads, moved, kept | state),
        times("left", "F, P, FP, c", "P[{}, c]", "FP[{}, c]"),
        times("right", "F, FP, P, c", "FP[c, {}]", "P[c, {}]"),
        function_source("look", "state, parameters, H", reads, seen, shown),
        functions_text(reduce_by_channel, inlined=True),
        functions_text(run, constants={"WIDTH": n, "SLOPES": max(1, len(slopes))}),
    )
    title = f"the posterior Cramér-Rao bound of the {model.name} form, in scaled units"
    return load_native(f"bound_{model.name}", kernel_text(title, *parts), {"run": signature_of(run)})


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
    """Return the least standard deviation with which this drive and these sensors can determine bulk modulus.

    Parameters
    ----------
    model : ProcessModel
        A model with the state ``bulk_modulus_pa``.
    prior : Gaussian
        Belief before the log, in SI; its bulk modulus is replaced by the parameters'.
    parameters : EhaParameters
        The actuator, with the bulk modulus for which the bound is wanted.
    variances : Mapping[str, float]
        Their variances [SI squared].
    noise : Mapping[str, float], optional
        Process-noise densities that replace the model's [SI squared per second].

    Returns
    -------
    float
        Standard deviation [Pa], see `posterior_bound`; infinite if the model's own run diverges.
    """
    start = prior.mean.copy()
    start[model.index(BULK_MODULUS)] = parameters.bulk_modulus
    known = {channel: variances[channel] for channel in channels}
    bound = posterior_bound(model, Gaussian(start, prior.covariance), record, parameters, variances=known, noise=noise)
    return float("inf") if bound.belief is None else float(bound.track(BULK_MODULUS)[-1])


def at_bulk_modulus(parameters: EhaParameters, bulk_modulus: float) -> EhaParameters:
    """Return the actuator's parameters for a process model, with another bulk modulus.

    Parameters
    ----------
    bulk_modulus : float
        Effective bulk modulus [Pa], convention of equation 5.8 (errata E2).

    Returns
    -------
    EhaParameters
        A copy of the parameters that every actuator has; the additional ones of a circuit do not affect a bound.
    """
    known = {field.name: getattr(parameters, field.name) for field in fields(EhaParameters)}
    return EhaParameters(**{**known, "bulk_modulus": bulk_modulus})
