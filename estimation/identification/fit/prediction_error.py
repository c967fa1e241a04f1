"""ARMAX and Box-Jenkins models: least squares of the one-step prediction, by Levenberg-Marquardt."""

from functools import partial

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.fitted import CovarianceKind, Task
from estimation.identification.fit.output_error import jacobian_and_residual, minimise
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.search.criterion import Structure
from estimation.identification.search.descent import stable
from estimation.identification.search.experiments import Experiments, Signals
from estimation.identification.search.levenberg import levenberg
from estimation.identification.search.noise_model import noise_start
from estimation.identification.search.one_step import prediction_errors
from estimation.identification.search.starts import least_squares_arx

MOST_STEPS = 100
"""Evaluations from each start."""

TOLERANCE = 1e-10
"""Share of the cost that a further step may promise at the end."""


def fit_armax(
    u: Signals,
    y: Signals,
    sample_time: float,
    *,
    n_numerator: int,
    n_denominator: int,
    n_c: int,
    delay: int = 0,
    covariance: CovarianceKind = "white",
    input_name: str = "input",
    output_name: str = "output",
) -> LinearModel:
    """Fit ``F y = B u + C e`` by least squares of the one-step prediction.

    Parameters
    ----------
    u, y : array_like, shape (n,), or a list of them
        Input, no gaps; output, NaN where missing: predicted there.
    sample_time : float
        Seconds between samples [s].
    n_numerator, n_denominator, n_c : int
        Free coefficients of B, F and C.
    delay : int
        Dead time [samples].
    covariance : {"white", "coloured", "auto"}
        As `fit_output_error`.

    Returns
    -------
    LinearModel
        ``structure="ARMAX"``, D = F.

    Raises
    ------
    HydrostateError
        As `fit_output_error`.
    """
    system = Structure(n_numerator, n_denominator, delay)
    return _fit(Task(system, sample_time, covariance, (input_name, output_name), n_c), u, y, "ARMAX", tied=True)


def fit_box_jenkins(
    u: Signals,
    y: Signals,
    sample_time: float,
    *,
    n_numerator: int,
    n_denominator: int,
    n_c: int,
    n_d: int,
    delay: int = 0,
    covariance: CovarianceKind = "white",
    input_name: str = "input",
    output_name: str = "output",
) -> LinearModel:
    """Fit ``y = B/F u + C/D e`` by least squares of the one-step prediction (Box and Jenkins, 1970).

    Parameters
    ----------
    u, y : array_like, shape (n,), or a list of them
        Input, no gaps; output, NaN where missing: predicted there.
    sample_time : float
        Seconds between samples [s].
    n_numerator, n_denominator, n_c, n_d : int
        Free coefficients of B, F, C and D.
    delay : int
        Dead time [samples].
    covariance : {"white", "coloured", "auto"}
        As `fit_output_error`.

    Returns
    -------
    LinearModel
        ``structure="Box-Jenkins"``.

    Raises
    ------
    HydrostateError
        As `fit_output_error`.
    """
    system = Structure(n_numerator, n_denominator, delay)
    task = Task(system, sample_time, covariance, (input_name, output_name), n_c, n_d)
    return _fit(task, u, y, "Box-Jenkins", tied=False)


def _fit(task: Task, u: Signals, y: Signals, structure: str, *, tied: bool) -> LinearModel:
    """Fit from every start; if tied, D is F."""
    data, form = task.experiments(u, y), task.form
    found = [_descend(task, tied, start, data) for start in _starts(task, tied, data)]
    _, theta, error, jacobian = min(found, key=lambda one: one[0])
    main, f, c, d, initial = _split(task, theta)
    noise = (np.concatenate([[1.0], c]), np.concatenate([[1.0], f if tied else d]))
    return task.model(np.concatenate([main, initial[: form.n_states]]), jacobian, error, data, structure, noise)


def _split(task: Task, theta: Array) -> list[Array]:
    """Return numerator with denominator, the denominator, C and D (each after its 1), and all initial states."""
    at_c = task.form.n_main
    main, c, d, initial = np.split(theta, [at_c, at_c + task.n_c, at_c + task.n_c + task.n_d])
    return [main, main[task.form.n_numerator :], c, d, initial]


def _acceptable(task: Task, tied: bool, theta: Array) -> bool:
    """Return whether the predictor is stable: C always, and F and D unless tied, when they cancel out of it."""
    _, f, c, d, _ = _split(task, theta)
    return bool(np.isfinite(theta).all() and stable(c) and (tied or (stable(f) and stable(d))))


def _starts(task: Task, tied: bool, data: Experiments) -> list[Array]:
    """Return starts: the output-error model with a model of its noise, the same without one, and ARX."""
    form, longest = task.form, data.longest
    output_error = minimise(form, data)
    main, initial = output_error[: form.n_main], output_error[form.n_main :]
    u, y = data.bridged()[data.slices.index(longest)]
    arx_b, arx_f = least_squares_arx(form.n_numerator, form.n_denominator, form.delay, u, y)
    quiet = np.zeros(task.n_c + task.n_d)
    starts = [np.concatenate([main, quiet, initial])]
    if quiet.size:
        f, v = (
            np.concatenate([[1.0], main[form.n_numerator :]]),
            jacobian_and_residual(form, output_error, data)[1][longest],
        )
        c, d = noise_start(np.convolve(v, f)[: v.size] if tied else v, task.n_c, task.n_d)
        starts.append(np.concatenate([main, c[1:], d[1:], initial]))
    starts.append(np.concatenate([arx_b[form.delay :], arx_f[1:], quiet, np.zeros_like(initial)]))
    return [start for start in starts if _acceptable(task, tied, start)]


def _descend(task: Task, tied: bool, start: Array, data: Experiments) -> tuple[float, Array, Array, Array]:
    """Return cost, values, prediction errors and Jacobian of the minimum that a descent from one start reaches."""
    n, p, form = data.u.size, start.size, task.form
    sizes = np.array([form.n_numerator, form.n_denominator, task.n_c, task.n_d, form.delay, form.n_initial])

    def predicted(theta: Array) -> tuple[float, Array, Array]:
        error, jacobian = np.zeros(n), np.zeros((n, p))
        cost = prediction_errors(theta, sizes, tied, data.u, data.y, data.used, data.bounds, error, jacobian)
        return cost, error, jacobian

    def normal(theta: Array) -> tuple[float, Array, Array]:
        cost, error, jacobian = predicted(theta)
        return cost, jacobian.T @ jacobian, -(jacobian.T @ error)

    acceptable = partial(_acceptable, task, tied)
    cost, theta = levenberg(normal, start, acceptable, tolerance=TOLERANCE, most_steps=MOST_STEPS)
    return cost, theta, *predicted(theta)[1:]
