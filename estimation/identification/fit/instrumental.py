"""Refined instrumental variables: consistent under output noise, without a search (Young 1976)."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.fitted import CovarianceKind, Task
from estimation.identification.fit.output_error import jacobian_and_residual
from estimation.identification.model.lags import lagged
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.model.recursion import filtered
from estimation.identification.search.criterion import Structure, profile, stabilised_denominator
from estimation.identification.search.experiments import Experiments, Signals
from estimation.identification.search.noise_model import noise_start
from estimation.identification.search.starts import least_squares_arx, reduced_high_order_arx
from plant.errors import HydrostateError

MOST_PASSES = 50
"""Refinements at most."""

SETTLED = 1e-8
"""Relative change of the coefficients at which the refinement ends."""


def fit_instrumental(
    u: Signals,
    y: Signals,
    sample_time: float,
    *,
    n_numerator: int,
    n_denominator: int,
    delay: int = 0,
    n_c: int = 0,
    n_d: int = 0,
    covariance: CovarianceKind = "white",
    input_name: str = "input",
    output_name: str = "output",
) -> LinearModel:
    """Fit ``y = B/F u + C/D e`` by refined instrumental variables; without C and D, by the simplified method (SRIV).

    Each pass filters input and output by the current ``D/(C F)``. The noise-free simulated output is the instrument,
    which removes the bias of ARX. The starts are ARX and a reduced high-order ARX; the better result is returned.

    Parameters
    ----------
    u, y : array_like, shape (n,), or a list of them
        Input and output, no gaps. Of several experiments, the coefficients are fitted to all.
    sample_time : float
        Seconds between samples [s].
    delay : int
        Dead time [samples].
    n_c, n_d : int
        Coefficients of the noise model behind their 1.
    covariance : {"white", "coloured", "auto"}
        As `fit_output_error`.

    Returns
    -------
    LinearModel
        ``structure="SRIV"``, or ``"RIV"`` with a noise model.

    Raises
    ------
    HydrostateError
        As `fit_output_error`, or if an output is missing.
    """
    form = Structure(n_numerator, n_denominator, delay)
    task = Task(form, sample_time, covariance, (input_name, output_name), n_c, n_d)
    data = task.experiments(u, y)
    if not data.used.all():
        raise HydrostateError(
            f"instrumental variables need every sample of {output_name!r}, got {int((~data.used).sum())} missing: "
            "use fit_output_error"
        )
    longest_u, longest_y = data.u[data.longest], data.y[data.longest]
    starts = [
        least_squares_arx(n_numerator, n_denominator, delay, longest_u, longest_y)[1],
        reduced_high_order_arx(n_denominator, longest_u, longest_y),
    ]
    found = [_refined(form, stabilised_denominator(f, longest_u.size), data, n_c, n_d) for f in starts]
    theta, noise, jacobian, residual = min(found, key=lambda one: float(one[3] @ one[3]))
    named = "RIV" if n_c + n_d else "SRIV"
    return task.model(theta, jacobian, residual, data, named, noise if n_c + n_d else None)


def _refined(
    form: Structure, f: Array, data: Experiments, n_c: int, n_d: int
) -> tuple[Array, tuple[Array, Array], Array, Array]:
    """Return values with initial states, noise model, Jacobian and whitened residual of one start."""
    n_b = form.n_numerator
    c, d = np.ones(1), np.ones(1)
    theta = _with_initial(form, f, data)
    for _ in range(MOST_PASSES):
        before = theta[: form.n_main]
        if n_c + n_d:
            c, d = noise_start(jacobian_and_residual(form, theta, data)[1][data.longest], n_c, n_d)
        values = _pass(form, before, data, c, d)
        theta = _with_initial(form, stabilised_denominator(np.concatenate([[1.0], values[n_b:]]), data.u.size), data)
        if np.abs(theta[: form.n_main] - before).max() <= SETTLED * np.abs(before).max():
            break
    jacobian, residual = jacobian_and_residual(form, theta, data)
    for part in data.slices:
        jacobian[part] = np.column_stack([filtered(d, c, column) for column in jacobian[part].T])
        residual[part] = filtered(d, c, residual[part])
    return theta, (c, d), jacobian, residual


def _pass(form: Structure, values: Array, data: Experiments, c: Array, d: Array) -> Array:
    """Return numerator and denominator of one weighted instrumental step, over all experiments."""
    n_b, n_f = form.n_numerator, form.n_denominator
    f = np.concatenate([[1.0], values[n_b:]])
    b = np.concatenate([np.zeros(form.delay), values[:n_b]])
    weight = np.convolve(c, f)
    gram, right = np.zeros((form.n_main, form.n_main)), np.zeros(form.n_main)
    begin = form.n_states
    for part in data.slices:
        inputs = filtered(d, weight, data.u[part])
        outputs = filtered(d, weight, data.y[part])
        clean = filtered(b, f, inputs)
        shared = lagged(inputs, form.delay, n_b)
        instruments = np.concatenate([shared, -lagged(clean, 1, n_f)], axis=1)[begin:]
        regressors = np.concatenate([shared, -lagged(outputs, 1, n_f)], axis=1)[begin:]
        gram += instruments.T @ regressors
        right += instruments.T @ outputs[begin:]
    return np.asarray(np.linalg.lstsq(gram, right, rcond=None)[0], dtype=np.float64)


def _with_initial(form: Structure, f: Array, data: Experiments) -> Array:
    """Return the best numerator and initial states for a denominator, by the longest experiment."""
    fits = [profile(form, f, data.u[part], data.y[part], data.used[part])[1] for part in data.slices]
    sizes = [part.stop - part.start for part in data.slices]
    return np.concatenate([fits[int(np.argmax(sizes))][: form.n_main], *(fit[form.n_main :] for fit in fits)])
