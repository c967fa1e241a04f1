"""Refined instrumental variables: consistent under output noise, without a search (Young 1976)."""

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.fitted import CovarianceKind, Task, without_offset
from estimation.identification.fit.output_error import jacobian_and_residual
from estimation.identification.model.lags import lagged
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.model.recursion import filtered
from estimation.identification.search.criterion import Structure, is_stable, predict, stabilised_denominator
from estimation.identification.search.experiments import Experiments, Signals
from estimation.identification.search.linear import least_squares
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
    estimate_offset: bool = False,
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
    estimate_offset : bool
        Whether a constant output, `LinearModel.offset`, is fitted along: in a short record, the mean is not the output
        at the mean input. Remove means first all the same, since starts are without it.

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
    task = Task(form, sample_time, covariance, (input_name, output_name), n_c, n_d, estimate_offset)
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
    found = [_refined(task, stabilised_denominator(f, longest_u.size), data) for f in starts]
    theta, noise, jacobian, residual = min(found, key=lambda one: float(one[3] @ one[3]))
    named, offset = "RIV" if n_c + n_d else "SRIV", float(theta[-1]) if estimate_offset else 0.0
    return task.model(theta, jacobian, residual, data, named, noise if n_c + n_d else None, offset)


def _refined(task: Task, f: Array, data: Experiments) -> tuple[Array, tuple[Array, Array], Array, Array]:
    """Return values with initial states and offset, noise model, Jacobian and whitened residual of one start."""
    form, c, d = task.form, np.ones(1), np.ones(1)
    theta = _with_denominator(task, f, data)
    for _ in range(MOST_PASSES):
        before = theta
        if task.n_c + task.n_d:
            c, d = noise_start(_sensitivities(task, theta, data)[1][data.longest], task.n_c, task.n_d)
        theta = _pass(task, before, data, c, d)
        f = np.concatenate([[1.0], theta[form.n_numerator : form.n_main]])
        if not is_stable(f):
            theta = _with_denominator(task, stabilised_denominator(f, data.u.size), data)
        moved = np.abs(theta - before)[: form.n_main]
        if moved.max() <= SETTLED * np.abs(before[: form.n_main]).max():
            break
    jacobian, residual = _sensitivities(task, theta, data)
    for part in data.slices:
        jacobian[part] = np.column_stack([filtered(d, c, column) for column in jacobian[part].T])
        residual[part] = filtered(d, c, residual[part])
    return theta, (c, d), jacobian, residual


def _sensitivities(task: Task, theta: Array, data: Experiments) -> tuple[Array, Array]:
    """Return derivatives of the simulated output by all values, and the residual."""
    if not task.estimate_offset:
        return jacobian_and_residual(task.form, theta, data)
    jacobian, residual = jacobian_and_residual(task.form, theta[:-1], without_offset(data, float(theta[-1])))
    return np.column_stack([jacobian, np.ones(residual.size)]), residual


def _pass(task: Task, theta: Array, data: Experiments, c: Array, d: Array) -> Array:
    """Return the values of one weighted instrumental step, over all experiments.

    The responses to initial states and to the offset are columns of their own, and their own instruments. Left out,
    they count as noise that follows the output, and move the poles of a short record.
    """
    form = task.form
    n_b, n_f, n_main, n_s = form.n_numerator, form.n_denominator, form.n_main, form.n_states
    size = n_main + int(task.estimate_offset)
    weight = np.convolve(c, np.concatenate([[1.0], theta[n_b:n_main]]))
    gram, right = np.zeros((size, size)), np.zeros(size)
    states: list[tuple[Array, Array, Array]] = []
    for index, part in enumerate(data.slices):
        own = theta[n_main + index * n_s : n_main + (index + 1) * n_s]
        inputs, outputs = filtered(d, weight, data.u[part]), filtered(d, weight, data.y[part])
        clean = filtered(d, weight, predict(form, np.concatenate([theta[:n_main], own]), data.u[part]))
        pulse = filtered(d, weight, np.eye(1, inputs.size)[0])
        shared, offset = lagged(inputs, form.delay, n_b), filtered(d, c, np.ones(inputs.size))
        level = offset[:, None][:, : size - n_main]
        instruments = np.concatenate([shared, -lagged(clean, 1, n_f), level], axis=1)
        regressors = np.concatenate([shared, -lagged(outputs, 1, n_f), level], axis=1)
        basis, triangle = np.linalg.qr(lagged(pulse, 0, n_s))
        instruments = instruments - basis @ (basis.T @ instruments)
        gram += instruments.T @ regressors
        right += instruments.T @ outputs
        states.append((triangle, basis.T @ outputs, basis.T @ regressors))
    values = np.asarray(np.linalg.lstsq(gram, right, rcond=None)[0], dtype=np.float64)
    initial = [least_squares(triangle, rest - moved @ values) for triangle, rest, moved in states]
    return np.concatenate([values[:n_main], *initial, values[n_main:]])


def _with_denominator(task: Task, f: Array, data: Experiments) -> Array:
    """Return the best numerator, initial states and offset for a denominator, over all experiments."""
    form = task.form
    n_b, n_main = form.n_numerator, form.n_main
    theta = np.zeros(n_main + form.n_states * data.count + int(task.estimate_offset))
    theta[n_b:n_main] = f[1:]
    # nothing is simulated yet, so the residual is the output
    jacobian, output = _sensitivities(task, theta, data)
    linear = np.delete(jacobian, np.s_[n_b:n_main], axis=1)
    scale = np.linalg.norm(linear, axis=0)
    scale[scale == 0.0] = 1.0
    values = least_squares(linear / scale, output) / scale
    theta[:n_b], theta[n_main:] = values[:n_b], values[n_b:]
    return theta
