"""Grey-box output-error fit: physical parameters of a readable model, by least squares with exact sensitivities.

The model's step is traced once; its derivatives by state and unknown parameters are written beside it, so one pass over
the log gives the prediction and its whole Jacobian. Unknowns are fitted as logarithms: they stay positive, and a start
that is wrong by a factor is as near as one that is wrong by its inverse.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from estimation.covariance import least_squares_covariance
from plant.compiled.expression import Expression, as_expression, jacobian, symbol, unary
from plant.compiled.functions import Scalar
from plant.compiled.kernel_file import load_kernel
from plant.compiled.source import statements
from plant.integrate import PARAMETER_NAMES, parameter_symbols

Array = NDArray[np.float64]
Drives: TypeAlias = tuple[tuple[Scalar, Scalar], ...]
"""For each driving channel its value at the start and at the end of a step."""

OUTLIER = 3.0
"""Residuals beyond this many standard deviations count linearly (Huber 1964) [dimensionless]."""

LEAST_EFFECT = 1.0
"""An unknown whose logarithm moves the whole prediction by less, in standard deviations of one sample, is not felt."""

SCREENED_SAMPLES = 200_000
"""A longer log is screened on its beginning."""

SCREENING = 12
"""Evaluations of the model that every start is given."""

FINALISTS = 2
"""Starts that are carried on to convergence."""

MOST_EVALUATIONS = 80
"""Evaluations of the model that a finalist may take."""

BLOCK = 1e-3
"""Length over which residuals are averaged before they are squared [s]."""


@dataclass(frozen=True)
class GreyBoxModel:
    """A model whose unknown parameters are fitted to a log.

    Parameters
    ----------
    name : str
        Name, for the kernel's file.
    drives : tuple of str
        Channels that drive the model; linear between samples.
    output : str
        Channel that is fitted.
    unknowns : tuple of str
        Parameters that are fitted, all positive.
    initial : callable
        ``initial(parameters)``: the state before the first sample, in SI.
    step : callable
        ``step(state, drives, parameters, h)`` in SI.
    observe : callable
        ``observe(state)``: the predicted output in SI.
    """

    name: str
    drives: tuple[str, ...]
    output: str
    unknowns: tuple[str, ...]
    initial: Callable[[Any], tuple[Scalar, ...]]
    step: Callable[[Any, Any, Any, Scalar], tuple[Scalar, ...]]
    observe: Callable[[Any], Scalar]


@dataclass(frozen=True, eq=False)
class GreyBoxFit:
    """What a fit found.

    Parameters
    ----------
    values : Mapping[str, float]
        Fitted parameters in SI.
    log_std : Mapping[str, float]
        Standard deviation of each one's logarithm, for a coloured residual [dimensionless]; infinite where the log does
        not determine it.
    chi_square : float
        Mean squared residual over its variance; 1 where the model explains the log [dimensionless].
    autocorrelation : float
        Of neighbouring residuals; 0 where the model explains the log [dimensionless].
    residual : ndarray, shape (n,)
        Measured less predicted, in SI; NaN where the sample is missing.
    """

    values: Mapping[str, float]
    log_std: Mapping[str, float]
    chi_square: float
    autocorrelation: float
    residual: Array


_KERNEL = '''"""Generated: prediction of the {name} model and its sensitivities."""

import math

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(theta, drives, parameters, sample_time, substeps):
    n = drives.shape[0]
    predicted = np.empty(n)
    sensitivity = np.empty((n, {unknowns}))
    h = sample_time / substeps
{load}
{begin}
    for k in range(n):
        if k > 0:
            for j in range(substeps):
                f_start = j / substeps
                f_end = (j + 1.0) / substeps
{between}
{step}
{observe}
    return predicted, sensitivity
'''


@cache
def compile_fit(model: GreyBoxModel) -> Callable[..., tuple[Array, Array]]:
    """Generate the kernel that predicts a log and differentiates the prediction.

    Parameters
    ----------
    model : GreyBoxModel
        The model.

    Returns
    -------
    callable
        ``run(theta (unknowns,), drives (n, channels), parameter row, sample time [s], substeps)``, which returns the
        prediction, shape (n,), and its derivatives by the logarithms, shape (n, unknowns).
    """
    count = len(model.unknowns)
    theta = [symbol(f"theta{i}") for i in range(count)]
    fitted = {name: unary("exp", t) for name, t in zip(model.unknowns, theta, strict=True)}
    p = SimpleNamespace(**{**vars(parameter_symbols()), **fitted})
    start = [as_expression(value) for value in model.initial(p)]
    width = len(start)
    state = [symbol(f"x{i}") for i in range(width)]
    drives = tuple((symbol(f"a{i}"), symbol(f"b{i}")) for i in range(len(model.drives)))
    moved = [as_expression(value) for value in model.step(tuple(state), drives, p, symbol("h"))]
    output = as_expression(model.observe(tuple(state)))
    source = _KERNEL.format(
        name=model.name,
        unknowns=count,
        load="\n".join(
            [f"    {name} = parameters[{i}]" for i, name in enumerate(PARAMETER_NAMES)]
            + [f"    theta{i} = theta[{i}]" for i in range(count)]
        ),
        begin=statements(_named(start) | _sensitivities(start, [], theta), "    "),
        between="\n".join(
            f"                {end}{i} = drives[k - 1, {i}] + f_{when} * (drives[k, {i}] - drives[k - 1, {i}])"
            for i in range(len(model.drives))
            for end, when in (("a", "start"), ("b", "end"))
        ),
        step=statements(_named(moved) | _sensitivities(moved, state, theta), " " * 16),
        observe=_observation(output, state, theta),
    )
    return load_kernel(f"fit_{model.name}", source).run


def _named(values: Sequence[Expression]) -> dict[str, Expression]:
    return {f"x{i}": value for i, value in enumerate(values)}


def _sensitivities(
    values: Sequence[Expression], state: Sequence[Expression], theta: Sequence[Expression]
) -> dict[str, Expression]:
    """Return the chain rule ``S' = F S + G`` for every value and unknown."""
    by_state, by_theta = jacobian(values, state), jacobian(values, theta)
    outputs: dict[str, Expression] = {}
    for i in range(len(values)):
        for j in range(len(theta)):
            total = by_theta[i][j]
            for m in range(len(state)):
                total = total + by_state[i][m] * symbol(f"s{m}_{j}")
            outputs[f"s{i}_{j}"] = total
    return outputs


def _observation(output: Expression, state: Sequence[Expression], theta: Sequence[Expression]) -> str:
    slopes = _sensitivities([output], state, theta)
    named = {"y": output} | {f"d{j}": slopes[f"s0_{j}"] for j in range(len(theta))}
    store = [f"        sensitivity[k, {j}] = d{j}" for j in range(len(theta))]
    return "\n".join([statements(named, " " * 8), "        predicted[k] = y", *store])


def fit_greybox(
    model: GreyBoxModel,
    drives: Array,
    measured: Array,
    parameters: Array,
    sample_time: float,
    *,
    starts: Sequence[Mapping[str, float]],
    variance: float,
    substeps: int,
) -> GreyBoxFit:
    """Fit the unknowns to a log, from several starts, and return the best.

    Parameters
    ----------
    model : GreyBoxModel
        The model.
    drives : ndarray, shape (n, channels)
        Driving channels in SI, no sample missing.
    measured : ndarray, shape (n,)
        Output channel in SI; NaN is missing.
    parameters : ndarray, shape (parameters,)
        Row of the actuator's parameters; the unknowns' entries are not used.
    sample_time : float
        Seconds between samples [s].
    starts : sequence of Mapping[str, float]
        First guesses of the unknowns in SI.
    variance : float
        Variance of the output's noise [SI squared].
    substeps : int
        Model steps a sample.

    Returns
    -------
    GreyBoxFit
        The best fit.
    """

    def part(stop: int | None) -> _Problem:
        return _Problem(model, drives[:stop], measured[:stop], parameters, sample_time, variance, substeps)

    beginning, whole = part(SCREENED_SAMPLES), part(None)
    screened = [beginning.solve(np.log([start[name] for name in model.unknowns]), SCREENING) for start in starts]
    finalists = sorted(screened, key=lambda solution: float(solution.cost))[:FINALISTS]
    finished = [whole.solve(solution.x, MOST_EVALUATIONS) for solution in finalists]
    theta = np.asarray(min(finished, key=lambda solution: float(solution.cost)).x, dtype=np.float64)
    predicted, _ = whole.run(theta, drives, parameters, sample_time, substeps)
    residual = measured - predicted
    errors = residual[np.isfinite(residual)] / float(np.sqrt(variance))
    return GreyBoxFit(
        values={name: float(np.exp(value)) for name, value in zip(model.unknowns, theta, strict=True)},
        log_std=_log_std(model, *whole.predict(tuple(theta))),
        chi_square=float(np.mean(errors**2)),
        autocorrelation=float(errors[1:] @ errors[:-1] / (errors @ errors)),
        residual=residual,
    )


class _Problem:
    """The least-squares problem of one log, on means over blocks of about `BLOCK` seconds.

    Averaging keeps what the log says about unknowns that act more slowly, and makes a 10 kHz log as cheap to solve as a
    1 kHz one. The last prediction is kept, since the optimiser asks for residual and slopes at the same point.
    """

    def __init__(
        self,
        model: GreyBoxModel,
        drives: Array,
        measured: Array,
        parameters: Array,
        sample_time: float,
        variance: float,
        substeps: int,
    ) -> None:
        self.run = compile_fit(model)
        block = max(1, round(BLOCK / sample_time))
        edges = np.arange(0, len(measured), block)
        present = np.isfinite(measured)
        counts = np.add.reduceat(present.astype(np.float64), edges)
        filled = np.where(present, measured, 0.0)

        def averaged(values: Array) -> Array:
            return np.add.reduceat(np.where(present, values, 0.0), edges)[counts > 0.0] / np.sqrt(
                counts[counts > 0.0] * variance
            )

        @lru_cache(maxsize=2)
        def predict(theta: tuple[float, ...]) -> tuple[Array, Array]:
            predicted, sensitivity = self.run(np.array(theta), drives, parameters, sample_time, substeps)
            columns = [averaged(column) for column in sensitivity.T]
            return _finite(averaged(predicted - filled)), _finite(np.column_stack(columns))

        self.predict = predict

    def solve(self, start: Array, evaluations: int) -> Any:
        """Return scipy's solution from a start, with outliers counted linearly."""
        return least_squares(
            lambda theta: self.predict(tuple(theta))[0],
            start,
            jac=lambda theta: self.predict(tuple(theta))[1],
            loss="huber",
            f_scale=OUTLIER,
            max_nfev=evaluations,
            x_scale="jac",
            bounds=(-80.0, 40.0),
        )


def _log_std(model: GreyBoxModel, errors: Array, slope: Array) -> Mapping[str, float]:
    """Return standard deviations; an unknown that hardly moves the prediction is left out and called undetermined."""
    felt = np.sqrt(np.einsum("ij,ij->j", slope, slope)) > LEAST_EFFECT
    stds = np.full(len(model.unknowns), np.inf)
    if np.any(felt):
        covariance = least_squares_covariance(slope[:, felt], errors, len(errors), coloured=True)
        stds[felt] = np.sqrt(np.diag(covariance))
    return dict(zip(model.unknowns, map(float, stds), strict=True))


def _finite(values: Array) -> Array:
    """Return the values with runaways held to a size that an optimiser can step back from."""
    return np.clip(np.nan_to_num(values, nan=1e6, posinf=1e6, neginf=-1e6), -1e6, 1e6)
