"""ARX models: linear least squares."""

from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.fitted import CovarianceKind, Task, without_offset
from estimation.identification.model.lags import lagged
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.model.recursion import filtered
from estimation.identification.search.criterion import Structure, profile
from estimation.identification.search.descent import stable
from estimation.identification.search.experiments import Experiments, Signals


def fit_arx(
    u: Signals,
    y: Signals,
    sample_time: float,
    *,
    n_numerator: int,
    n_denominator: int,
    delay: int = 0,
    covariance: CovarianceKind = "white",
    estimate_offset: bool = False,
    input_name: str = "input",
    output_name: str = "output",
) -> LinearModel:
    """Fit ``F y = B u + e`` by linear least squares; rows with a missing output are left out.

    Biased unless the noise enters inside the loop, behind ``1/F``: under output noise use `fit_output_error`.

    Parameters
    ----------
    u, y : array_like, shape (n,), or a list of them
        Input, no gaps; output, NaN where missing.
    sample_time : float
        Seconds between samples [s].
    delay : int
        Dead time [samples].
    covariance : {"white", "coloured", "auto"}
        As `fit_output_error`.
    estimate_offset : bool
        Whether a constant output, `LinearModel.offset`, is fitted along: in a short record, the mean is not the output
        at the mean input. Remove means first all the same, since starts are without it.

    Returns
    -------
    LinearModel
        ``structure="ARX"``, D = F.

    Raises
    ------
    HydrostateError
        As `fit_output_error`.

    Examples
    --------
    >>> u = np.sign(np.sin(0.05 * np.arange(400) ** 1.3))
    >>> y = LinearModel([0.2, 0.1], [1.0, -0.7], 0.01, "u", "y").simulate(u)
    >>> fit_arx(u, y, 0.01, n_numerator=2, n_denominator=1).denominator.round(6).tolist()
    [1.0, -0.7]
    """
    form = Structure(n_numerator, n_denominator, delay)
    task = Task(form, sample_time, covariance, (input_name, output_name), estimate_offset=estimate_offset)
    data = task.experiments(u, y)
    rows, target, kept = [], [], np.zeros(data.u.size, dtype=bool)
    begin = max(n_denominator, delay + n_numerator - 1)
    for part in data.slices:
        measured = data.measured()[part]
        columns = np.concatenate(
            [
                lagged(data.u[part], delay, n_numerator),
                -lagged(measured, 1, n_denominator),
                np.ones((measured.size, int(estimate_offset))),
            ],
            axis=1,
        )
        whole = np.isfinite(columns).all(axis=1) & np.isfinite(measured)
        whole[:begin] = False
        kept[part] = whole
        rows.append(np.where(whole[:, None], columns, 0.0))
        target.append(np.where(whole, measured, 0.0))
    regressors, wanted = np.concatenate(rows), np.concatenate(target)
    values = np.linalg.lstsq(regressors, wanted, rcond=None)[0]
    residual = wanted - regressors @ values
    b, f = values[:n_numerator], values[n_numerator : form.n_main]
    # the constant stands outside the loop that F closes; a pole at 1 has none
    rest = 1.0 + float(f.sum())
    offset = float(values[-1]) / rest if estimate_offset and rest != 0.0 else 0.0
    theta = np.concatenate([b, f, _initial_state(form, b, f, without_offset(data, offset))])
    noise = (np.ones(1), np.concatenate([[1.0], f]))
    return task.model(theta, regressors, residual, replace(data, used=kept), "ARX", noise, offset)


def _initial_state(form: Structure, b: Array, f: Array, data: Experiments) -> Array:
    """Return the initial state with which a stable model simulates the first experiment best."""
    if not stable(f):
        return np.zeros(form.n_states)
    part = data.slices[0]
    only = Structure(1, f.size, form.n_states)
    numerator = np.concatenate([np.zeros(form.delay), b])
    missing = data.y[part] - filtered(numerator, np.concatenate([[1.0], f]), data.u[part])
    used = data.used[part]
    theta = profile(only, np.concatenate([[1.0], f]), np.zeros(missing.size), np.where(used, missing, 0.0), used)[1]
    return theta[1 + f.size : 1 + f.size + form.n_states]
