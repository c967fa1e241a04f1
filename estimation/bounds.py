"""How well could anyone do? The posterior Cramér-Rao bound of every state along a drive."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from estimation.algebra import belief_symbols, bounded, observed, scaled_step
from estimation.eha import BULK_MODULUS
from estimation.gaussian import Gaussian
from estimation.identification.preprocess import bridged
from estimation.model import ProcessModel
from estimation.run import TRACK_ROWS
from plant.compiled.expression import ONE, ZERO, Expression, jacobian
from plant.compiled.kernel_file import load_kernel
from plant.compiled.source import statements
from plant.eha import EhaParameters
from plant.errors import HydrostateError, LogError
from plant.integrate import parameter_row
from plant.record import Record

Array = NDArray[np.float64]

FINEST_STEP = 1e-4
"""Step of the model along the trajectory, or less where the log is sampled faster [s]."""


@dataclass(frozen=True, eq=False)
class Bound:
    """The posterior Cramér-Rao bound along a run.

    Parameters
    ----------
    model : ProcessModel
        The model.
    time : ndarray, shape (rows,)
        Times of the track [s].
    mean : ndarray, shape (rows, n)
        The trajectory along which the bound was taken [SI].
    std : ndarray, shape (rows, n)
        Least standard deviation of every state [SI]; infinite where the model's own run does not stay finite.
    belief : Gaussian or None
        Trajectory's end and least covariance there [SI]; None where the run does not stay finite.
    """

    model: ProcessModel
    time: Array
    mean: Array
    std: Array
    belief: Gaussian | None

    def track(self, state: str) -> Array:
        """Return the bound of one state along the run.

        Parameters
        ----------
        state : str
            State name.

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
    parameters: EhaParameters,
    *,
    variances: Mapping[str, float],
    noise: Mapping[str, float] | None = None,
) -> Bound:
    """Return the least covariance with which the states can be known, from this drive and these sensors.

    The bound's recursion (Tichavský, Muravchik and Nehorai 1998, equation 21) is that of the extended Kalman filter's
    covariance, taken along the true trajectory: here what the model itself does, noiseless, from the prior's mean under
    the record's drive. A parameter that is a state, of `estimation.augment` or of the user's own, has its bound too.
    While the piston sticks, position and velocity hold nothing about bulk modulus (errata E13).

    Parameters
    ----------
    model : ProcessModel
        The model.
    prior : Gaussian
        Truth at the first sample, and how well it is known then [SI]; a variance of 0 is exact knowledge.
    record : Record
        The drive, on its clock; what it measured plays no part.
    parameters : EhaParameters
        The actuator.
    variances : Mapping[str, float]
        Variance of each channel measured [SI squared].
    noise : Mapping[str, float], optional
        Process-noise densities that replace the model's, by state name [SI squared a second]; of a logarithmic state,
        those of the logarithm [1/s].

    Returns
    -------
    Bound
        Standard deviations along the run.

    Raises
    ------
    HydrostateError
        If the model does not predict a channel, or a variance is not positive.
    LogError
        If the record lacks a drive.
    """
    missing = [drive for drive in model.drives if drive not in record]
    if missing:
        raise LogError(f"the {model.name} form is driven by {', '.join(missing)}, the record has {', '.join(record)}")
    for channel, variance in variances.items():
        if not variance > 0.0:
            raise HydrostateError(f"the variance of {channel} must be positive, got {variance}")
    scaled = model.to_filter(prior)
    density = np.array([(noise or {}).get(state.name, state.noise_density) for state in model.states])
    squared = np.array([1.0 if state.logarithmic else state.scale**2 for state in model.states])
    substeps = max(model.substeps(record.sample_time), round(record.sample_time / FINEST_STEP))
    every = max(1, len(record) // TRACK_ROWS)
    rows = (len(record) - 1) // every + 1
    mean, std = np.empty((rows, model.width)), np.empty((rows, model.width))
    covariance = _compile(model, tuple(variances)).run(
        scaled.mean.copy(),
        scaled.covariance.copy(),
        density / squared * record.sample_time / substeps,
        np.array(list(variances.values()), dtype=np.float64),
        np.column_stack([bridged(record[drive]) for drive in model.drives]),
        parameter_row(parameters)[: len(fields(model.parameters))],
        record.sample_time / substeps,
        substeps,
        every,
        mean,
        std,
    )
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


_KERNEL = '''"""Generated: the posterior Cramér-Rao bound of the {name} form, in scaled units."""

import math

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(mean, P, noise, variances, drives, parameters, h, substeps, every, track, deviations):
    FP = np.empty(({width}, {width}))
    PH = np.empty({width})
    share = 1.0 / substeps
{load}
{state}
    for k in range(drives.shape[0]):
        if k > 0:
{drive}
            for j in range(substeps):
{step}
                for c in range({width}):
{rows}
                for c in range({width}):
{columns}
                for c in range({width}):
                    P[c, c] += noise[c]
{measure}
        if k % every == 0:
            row = k // every
{store}
            for c in range({width}):
                deviations[row, c] = math.sqrt(max(P[c, c], 0.0))
    return P
'''

_UPDATE = """        for c in range({width}):
            PH[c] = {PH}
        weight = 1.0 / ({HPH} + variances[{channel}])
        for c in range({width}):
            for d in range(c, {width}):
                P[c, d] -= PH[c] * PH[d] * weight
                P[d, c] = P[c, d]"""


@cache
def _compile(model: ProcessModel, channels: tuple[str, ...]) -> ModuleType:
    """Generate the recursion: the step and its Jacobian written out, the covariance in loops over what is not zero.

    Written out whole, as the filters are, thirteen states take a compiler a minute.
    """
    n = model.width
    mean, _ = belief_symbols(model)
    stepped, F = scaled_step(model)
    H = jacobian(observed(model, mean, channels), mean)
    moving = [i for i in range(n) if any(F[i][k] is not (ONE if i == k else ZERO) for k in range(n))]
    slopes = {f"F{i}_{k}": F[i][k] for i in moving for k in range(n) if F[i][k] is not ZERO}
    outputs: dict[str, Expression] = {**slopes, **{f"z{i}": z for i, z in enumerate(bounded(model, stepped))}}

    def product(array: str, i: int, place: str) -> str:
        return " + ".join(f"F{i}_{k} * {array}[{place.format(k=k)}]" for k in range(n) if F[i][k] is not ZERO) or "0.0"

    rows = [f"FP[{i}, c] = " + (product("P", i, "{k}, c") if i in moving else f"P[{i}, c]") for i in range(n)]
    columns = [f"P[c, {i}] = " + (product("FP", i, "c, {k}") if i in moving else f"FP[c, {i}]") for i in range(n)]
    measures: list[str] = []
    for c in range(len(channels)):
        seen = {f"H{c}_{k}": H[c][k] for k in range(n) if H[c][k] is not ZERO}
        measures.append(statements(seen, " " * 8))
        terms = [(f"H{c}_{k}", k) for k in range(n) if f"H{c}_{k}" in seen]
        PH = " + ".join(f"{name} * P[{k}, c]" for name, k in terms) or "0.0"
        HPH = " + ".join(f"{name} * PH[{k}]" for name, k in terms) or "0.0"
        measures.append(_UPDATE.format(width=n, PH=PH, HPH=HPH, channel=c))
    drive = [f"a{i} = drives[k - 1, {i}]\n            b{i} = drives[k, {i}]" for i in range(len(model.drives))]
    source = _KERNEL.format(
        name=model.name,
        width=n,
        load="\n".join(f"    {field.name} = parameters[{i}]" for i, field in enumerate(fields(model.parameters))),
        state="\n".join(f"    z{i} = mean[{i}]" for i in range(n)),
        drive="\n".join(f"            {line}" for line in drive),
        step=statements(outputs, " " * 16),
        rows="\n".join(f"{' ' * 20}{line}" for line in rows),
        columns="\n".join(f"{' ' * 20}{line}" for line in columns),
        measure="\n".join(measures),
        store="\n".join(f"            track[row, {i}] = z{i}" for i in range(n)),
    )
    return load_kernel(f"bound_{model.name}", source)


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

    Parameters
    ----------
    model : ProcessModel
        A model with the state ``bulk_modulus_pa``.
    prior : Gaussian
        Belief before the log, in SI; its bulk modulus is replaced by the parameters'.
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
        Standard deviation [Pa], see `posterior_bound`; infinite where the model's own run does not stay finite.
    """
    start = prior.mean.copy()
    start[model.index(BULK_MODULUS)] = parameters.bulk_modulus
    known = {channel: variances[channel] for channel in channels}
    bound = posterior_bound(model, Gaussian(start, prior.covariance), record, parameters, variances=known, noise=noise)
    return float("inf") if bound.belief is None else float(bound.track(BULK_MODULUS)[-1])


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
