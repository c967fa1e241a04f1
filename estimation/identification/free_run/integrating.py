"""Linear models that integrate: one pole is at 1, and the rest of the model is fitted to summed inputs.

A pole estimated near 1 decays over a few records, so that a run over new data drifts off. Its descent follows a curved
valley, in which offset, initial state and pole together make one ramp. With the pole given, the inputs are summed, the
ramp is a column, and the other poles are as easy to fit as those of a stable plant. See decision 295.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.linear_fit import fit_linear, steiglitz_mcbride
from estimation.identification.free_run.linear_kernel import settles
from estimation.identification.free_run.linear_problem import Form, LinearFit, Problem

POLE_RECORDS = 1e3
"""Time constant of the pole that is written in place of 1 [records]: a run begins at rest, which a pole at 1 does not
have."""


ACCEPTED_COST_CHANGE, LEAST_DENOMINATOR_SUM = 0.01, 1e-12
"""Relative change of the cost by writing it in this way that is accepted, and least ratio of a denominator's sum to its
coefficients: beside other poles close to 1 the sum is rounding, and a run begins at the first input divided by it."""


def fit_integrating(
    form: Form, data: Channels, starts: Sequence[Array], *, search: bool = False, least_gain: float = 0.0
) -> LinearFit:
    """Return the best linear model of one form that has a pole at 1.

    Parameters
    ----------
    form : Form
        Of order one or more, including the pole at 1.
    data : Channels
        Scaled.
    starts : sequence of ndarray, shape (n + 1,)
        Denominators at which to begin; the pole nearest to 1 is removed from each.
    search : bool
        Whether others are tried as well.
    least_gain : float
        As `levenberg` takes it [dimensionless].

    Returns
    -------
    LinearFit
        Its pole has a time constant of `POLE_RECORDS` records. The cost is infinite if such a model cannot be written.
    """
    summed, scales = _summed_inputs(data)
    inner = Form(
        form.order - 1,
        (*form.sizes, *[1] * (len(summed.inputs) - len(form.sizes))),
        (*form.delays, *_zero_delays(data)),
    )
    if inner.order == 0:
        cost, theta = Problem(inner, summed).profiled(np.ones(1))
        found = LinearFit(inner, theta, cost)
    else:
        begun = [_without_slowest(f) for f in starts]
        begun += steiglitz_mcbride(Problem(inner, summed)) if search else []
        found = fit_linear(inner, summed, begun, least_gain=least_gain)
    return _fit_of_inputs(form, data, found, scales)


def refitted_linear(fit: LinearFit, data: Channels, *, least_gain: float = 0.0) -> LinearFit:
    """Return a fit of the same kind to other data, started at its end.

    Parameters
    ----------
    data : Channels
        Scaled.
    least_gain : float
        As `levenberg` takes it [dimensionless].
    """
    if fit.integrates:
        return fit_integrating(fit.form, data, [fit.f], least_gain=least_gain)
    return fit_linear(fit.form, data, [fit.f], bounded=fit.bounded, least_gain=least_gain)


def _zero_delays(data: Channels) -> list[int]:
    return [0] * (2 * len(data.u) - 1)


def _summed_inputs(data: Channels) -> tuple[Channels, Array]:
    """Return summed inputs with a ramp in every log, and a level in every log but the first; and their scaling.

    The level of an input before a log is part of the ramp, so that sums are at rest before it.
    """
    sums = [np.cumsum(u - u[0], axis=0) for u in data.u]
    scales = np.maximum(np.sqrt(np.mean(np.concatenate(sums) ** 2, axis=0)), 1e-300)
    logs = len(data.u)
    columns = list[Array]()
    for index, one in enumerate(sums):
        ramps, levels = np.zeros((len(one), logs)), np.zeros((len(one), logs - 1))
        ramps[:, index] = np.arange(len(one)) / data.longest
        if index:
            levels[:, index - 1] = 1.0
        columns.append(np.column_stack([one / scales, ramps, levels]))
    names = (*data.inputs, *(f"ramp {k}" for k in range(logs)), *(f"level {k}" for k in range(1, logs)))
    return replace(data, inputs=names, u=tuple(columns), own_offsets=False), scales


def _without_slowest(f: Array) -> Array:
    """Return a denominator without its root nearest to 1; the rest of a complex pair becomes real."""
    roots = np.roots(f)
    kept = np.delete(roots, int(np.argmin(np.abs(roots - 1.0))))
    left = np.poly(kept)
    return np.asarray(np.poly(kept.real) if np.iscomplexobj(left) else left, dtype=np.float64)


def _fit_of_inputs(form: Form, data: Channels, found: LinearFit, scales: Array) -> LinearFit:
    """Return a fit to summed inputs as one of the inputs themselves, with initial states by least squares."""
    b = [numerator / scale for numerator, scale in zip(found.numerators, scales, strict=False)]
    pole = float(np.exp(-1.0 / (POLE_RECORDS * data.longest)))
    f, settled = np.convolve(found.f, [1.0, -pole]), float(found.f.sum())
    if not settles(f[1:]) or f.sum() < LEAST_DENOMINATOR_SUM * np.abs(f).sum():
        return LinearFit(form, np.zeros(Problem(form, data).n_parameters), float("inf"), integrates=True)
    gains = np.array([one.sum() for one in b]) / settled
    ramps = found.numerators[len(b) : len(b) + len(data.u)]
    slopes = [float(ramp[0]) / settled / data.longest for ramp in ramps]
    # with inputs at zero the output covers the share 1 - pole of its distance from the offset in each sample
    drift = [slope - float(gains @ u[0]) for slope, u in zip(slopes, data.u, strict=True)]
    offset = float(np.average(drift, weights=[y.size for y in data.y])) / (1.0 - pole)
    problem = Problem(form, data)
    columns, used = problem.linear_columns(f), problem.used
    driven = columns[:, : form.n_b + 1] @ np.concatenate([*b, [offset]])
    free = columns[:, form.n_b + 1 :]
    states = np.linalg.lstsq(free[used], (problem.y - driven)[used], rcond=None)[0]
    left = (problem.y - driven - free @ states)[used]
    cost = problem.share * float(left @ left)
    # several logs share one offset here, but had one ramp each
    cost = cost if len(data.u) > 1 or cost <= (1.0 + ACCEPTED_COST_CHANGE) * found.cost else float("inf")
    return LinearFit(form, np.concatenate([*b, f[1:], [offset], states]), cost, integrates=True)
