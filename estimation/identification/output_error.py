"""Output-error identification: the transfer function whose *simulated* output is closest to the measured."""

import hashlib
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from estimation.covariance import least_squares_covariance
from estimation.identification.criterion import (
    BoolArray,
    Structure,
    is_stable,
    predict,
    profile,
    sensitivities,
)
from estimation.identification.linear_model import FloatArray, LinearModel
from estimation.identification.starts import lagged, starting_denominators
from plant.errors import HydrostateError

SAMPLES_PER_PARAMETER = 5
"""Fewest output samples a free value; below that the covariance formula means nothing."""

SCREENING_SAMPLES = 50_000
"""A longer record is screened on its liveliest section of about this length, and fitted whole afterwards."""

TOLERANCE = 1e-10
"""Relative change of cost and of values at which the iteration ends; a standard deviation is 1 / sqrt(n)."""

FINAL_STEPS = 200
"""Most function evaluations given to a finalist."""

FINALISTS = 3
"""Starts that are iterated to convergence, after a few steps from each."""

SAME_MINIMUM = 1e-9
"""Starts whose costs agree to this share after the first steps have found the same minimum."""

SCREENING_STEPS = 12
"""Function evaluations given to each start before the finalists are chosen."""


def fit_output_error(
    u: ArrayLike,
    y: ArrayLike,
    sample_time: float,
    *,
    n_numerator: int,
    n_denominator: int,
    delay: int = 0,
    estimate_initial_state: bool = True,
    covariance: Literal["white", "coloured"] = "white",
    input_name: str = "input",
    output_name: str = "output",
) -> LinearModel:
    """Fit ``y = B/F u + e`` by minimising the sum of squared ``e`` (section 4 of the EHA paper; Table 6).

    Table 6 has ``n_numerator=3, n_denominator=2, delay=0``; a strictly proper second-order model
    ``n_numerator=2, n_denominator=2, delay=1``. Missing output samples (NaN) are left out of the sum. Means
    are not removed: see `estimation.identification.preprocess.detrend`.

    Parameters
    ----------
    u : array_like, shape (n,)
        Input, in the unit that its name says; no gaps.
    y : array_like, shape (n,)
        Output, in the unit that its name says; NaN where missing.
    sample_time : float
        Seconds between samples [s].
    n_numerator, n_denominator : int
        Free coefficients of ``B`` and ``F``, at least 1 each.
    delay : int
        Dead time [samples].
    estimate_initial_state : bool
        Whether the state at the first sample is estimated along; otherwise the data begin at rest.
    covariance : {"white", "coloured"}
        ``"white"``: ``s^2 (J'J)^-1``, right if the residual is white. ``"coloured"``: the sandwich
        ``(J'J)^-1 J'RJ (J'J)^-1`` with the residual's autocovariance ``R``, needed for filtered data, whose
        nominal 95 % intervals cover about 35 %.
    input_name, output_name : str
        Channel names for the result and the messages.

    Returns
    -------
    LinearModel
        The model, with covariance, fit and the initial state.

    Raises
    ------
    HydrostateError
        If the arrays do not match or hold unusable values, the record is too short, or the input does not
        excite as many coefficients as are wanted.

    Examples
    --------
    >>> u = np.sign(np.sin(0.05 * np.arange(400) ** 1.3))
    >>> y = LinearModel([0.2, 0.1], [1.0, -0.7], 0.01, "u", "y").simulate(u)
    >>> fit_output_error(u, y, 0.01, n_numerator=2, n_denominator=1).denominator.round(6).tolist()
    [1.0, -0.7]
    """
    structure = _checked_structure(n_numerator, n_denominator, delay, estimate_initial_state)
    u_values, y_values = _checked_data(u, y, structure, input_name, output_name)
    used = np.isfinite(y_values)
    u_scale = float(np.sqrt(np.mean(u_values**2)))
    y_scale = float(np.sqrt(np.mean(y_values[used] ** 2)))
    scaled_u, scaled_y = u_values / u_scale, y_values / y_scale
    theta = _minimise(structure, scaled_u, scaled_y, used)
    jacobian = sensitivities(structure, theta, scaled_u)
    jacobian[~used] = 0.0
    residual = np.where(used, scaled_y - predict(structure, theta, scaled_u), 0.0)
    spread = least_squares_covariance(jacobian, residual, int(used.sum()), coloured=covariance == "coloured")

    n_b, n_f = structure.n_numerator, structure.n_denominator
    unscale = np.concatenate([np.full(n_b, y_scale / u_scale), np.ones(n_f), np.full(structure.n_initial, y_scale)])
    b, f, state = structure.split(theta * unscale)
    rss = float(residual @ residual) * y_scale**2
    n_used = int(used.sum())
    deviation = y_values[used] - y_values[used].mean()
    block = slice(0, n_b + n_f)
    return LinearModel(
        numerator=b,
        denominator=f,
        sample_time=sample_time,
        input_name=input_name,
        output_name=output_name,
        delay=delay,
        covariance=(spread * np.outer(unscale, unscale))[block, block],
        initial_state=state,
        fit_percent=100.0 * (1.0 - float(np.sqrt(rss / (deviation @ deviation)))),
        rmse=float(np.sqrt(rss / n_used)),
        residual_std=float(np.sqrt(rss / (n_used - structure.n_parameters))),
        n_samples=n_used,
        data_hash=data_hash(u_values, y_values, sample_time),
    )


def data_hash(u: FloatArray, y: FloatArray, sample_time: float) -> str:
    """Return the SHA-256 of input, output and sample time as little-endian doubles.

    Parameters
    ----------
    u, y : ndarray, shape (n,)
        Input and output.
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    str
        Hexadecimal digest.
    """
    digest = hashlib.sha256()
    for values in (u, y, np.array([sample_time])):
        digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()


def _checked_structure(n_numerator: int, n_denominator: int, delay: int, initial: bool) -> Structure:
    if n_numerator < 1 or n_denominator < 1 or delay < 0:
        raise HydrostateError(
            "n_numerator and n_denominator must be at least 1 and delay at least 0, "
            f"got {n_numerator}, {n_denominator} and {delay}"
        )
    return Structure(n_numerator, n_denominator, delay, initial)


def _checked_data(
    u: ArrayLike, y: ArrayLike, structure: Structure, input_name: str, output_name: str
) -> tuple[FloatArray, FloatArray]:
    inputs, outputs = np.asarray(u, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if inputs.ndim != 1 or inputs.shape != outputs.shape:
        raise HydrostateError(
            f"input {input_name!r} and output {output_name!r} must be one-dimensional and of one length, "
            f"got shapes {inputs.shape} and {outputs.shape}"
        )
    n_bad = int(np.count_nonzero(~np.isfinite(inputs)))
    if n_bad:
        raise HydrostateError(
            f"input {input_name!r} must be known at every sample, got {n_bad} missing or infinite of {inputs.size}"
        )
    if np.isinf(outputs).any():
        raise HydrostateError(f"output {output_name!r} must be finite or missing (NaN), got infinite values")
    n_used = int(np.count_nonzero(np.isfinite(outputs)))
    wanted = SAMPLES_PER_PARAMETER * structure.n_parameters
    if n_used < wanted:
        raise HydrostateError(
            f"a fit of {structure.n_parameters} values needs at least {wanted} samples of {output_name!r}, got {n_used}"
        )
    if np.nanmin(outputs) == np.nanmax(outputs):
        raise HydrostateError(f"output {output_name!r} must vary, got {np.nanmin(outputs):g} throughout")
    _require_excitation(inputs, structure, input_name)
    return inputs, outputs


def _require_excitation(u: FloatArray, structure: Structure, input_name: str) -> None:
    wanted = structure.n_numerator + structure.n_denominator
    if u.min() == u.max():
        raise HydrostateError(
            f"input {input_name!r} must excite {wanted} coefficients, got the constant {u[0]:g}: "
            "use steps, a chirp or a pseudo-random binary signal"
        )
    excited = int(np.linalg.matrix_rank(lagged(u, 0, wanted)[wanted - 1 :]))
    if excited < wanted:
        raise HydrostateError(
            f"input {input_name!r} must excite {wanted} coefficients, got a signal that excites {excited} "
            "(a sine excites two): use steps, a chirp or a pseudo-random binary signal"
        )


def _minimise(structure: Structure, u: FloatArray, y: FloatArray, used: BoolArray) -> FloatArray:
    """Return ``[b, f, initial state]`` of the lowest minimum found from all starts."""
    section = _liveliest_section(u, used)
    u_part, y_part, used_part = u[section], y[section], used[section]
    samples = np.arange(y_part.size)
    filled = np.interp(samples, samples[used_part], y_part[used_part])
    screened: list[tuple[float, FloatArray]] = []
    for denominator in starting_denominators(structure, u_part, filled):
        start = profile(structure, denominator, u_part, y_part, used_part)[1]
        screened.append(_levenberg_marquardt(structure, start, u_part, y_part, used_part, SCREENING_STEPS))
    finalists: list[tuple[float, FloatArray]] = []
    for cost, theta in sorted(screened, key=lambda found: found[0]):
        is_new = all(cost - other > SAME_MINIMUM * cost for other, _ in finalists)
        if is_new and len(finalists) < FINALISTS:
            finalists.append((cost, theta))
    finished: list[tuple[float, FloatArray]] = []
    for _, theta in finalists:
        start = profile(structure, structure.split(theta)[1], u, y, used)[1]
        finished.append(_levenberg_marquardt(structure, start, u, y, used, FINAL_STEPS))
    return min(finished, key=lambda found: found[0])[1]


def _liveliest_section(u: FloatArray, used: BoolArray) -> slice:
    """Return where the input varies most over SCREENING_SAMPLES samples; everything, if there are no more."""
    n_sections = max(1, u.size // SCREENING_SAMPLES)
    length = u.size // n_sections
    if n_sections == 1:
        return slice(None)
    moves = [
        float(np.var(u[k : k + length]) * used[k : k + length].mean()) for k in range(0, n_sections * length, length)
    ]
    begin = int(np.argmax(moves)) * length
    return slice(begin, begin + length)


def _levenberg_marquardt(
    structure: Structure, start: FloatArray, u: FloatArray, y: FloatArray, used: BoolArray, evaluations: int
) -> tuple[float, FloatArray]:
    """Return cost and values after at most so many evaluations from a start.

    A step that leaves the unit circle is answered with a large finite residual instead of a simulation, which
    would overflow: Levenberg-Marquardt then rejects the step and shortens the next, and stability costs no
    bound that an optimum could be pressed against.
    """
    n_b, n_f = structure.n_numerator, structure.n_denominator
    target, complete = y[used], bool(used.all())
    refused = np.full(target.size, 1e3 * float(np.abs(target).max()))

    def residual(theta: FloatArray) -> FloatArray:
        if not is_stable(np.concatenate([[1.0], theta[n_b : n_b + n_f]])):
            return refused
        return predict(structure, theta, u)[used] - target

    def jacobian(theta: FloatArray) -> FloatArray:
        columns = sensitivities(structure, theta, u)
        return columns if complete else columns[used]

    found = least_squares(
        residual,
        start,
        jac=jacobian,
        method="lm",
        x_scale="jac",
        ftol=TOLERANCE,
        xtol=TOLERANCE,
        gtol=TOLERANCE,
        max_nfev=evaluations,
    )
    return 2.0 * float(found.cost), np.asarray(found.x, dtype=np.float64)
