"""Intervals of the steady-state gain by profile likelihood, for models whose Hessian gives wrong ones.

If a pole nearly cancels a zero, the gain is far from linear in the coefficients, and the interval from the covariance
covers too little: 68 % instead of 95 % on the fourth model of Table 6 at 50 % noise. The profile finds the range of
gains to which a fit can be forced at a cost that chance explains (Venzon and Moolgavkar 1988).
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.output_error import descend_from
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.search.criterion import Structure
from estimation.identification.search.descent import normal_equations, stable
from estimation.identification.search.experiments import Experiments, Signals, experiments_from
from estimation.identification.search.levenberg import levenberg
from estimation.identification.search.starts import starting_values
from estimation.trust.chi_square import chi_square_quantile
from plant.errors import HydrostateError

OTHER_STARTS = 6
"""Basins beside the fitted one that a forced gain may be reached from, where a pole is nearly cancelled; one elsewhere.
With 2 instead of 6 the interval covers 91 % instead of 96 % on the model named above."""

MOST_STEPS = 40
"""Evaluations of the forced fit from each start."""

NEAR = 1e-3
"""Share of the rise that chance explains by which a forced fit may still be too costly at its end [fraction]."""

BISECTIONS = 8
"""Halvings of the bracket around an end of the interval."""

WIDENINGS = 40
"""Widenings of the first guess before an interval is called unbounded."""


def dc_gain_interval(
    model: LinearModel, u: Signals, y: Signals, *, level: float = 0.95, estimate_initial_state: bool = True
) -> tuple[float, float]:
    """Return the interval of the steady-state gain by profile likelihood.

    If the model's covariance gives the gain another variance than the white one, the threshold is stretched by their
    ratio. The place of a nearly cancelled pole is not determined, so the likelihood ratio exceeds that of regular
    models. Each such pole counts as one more degree of freedom.

    Parameters
    ----------
    model : LinearModel
        An output-error model, fitted to these data.
    u, y : array_like of shape (n,), or a sequence of them
        The data, as `fit_output_error` took them.
    level : float
        Probability of the interval.

    Returns
    -------
    tuple of float
        Lowest and highest gain [output unit per input unit]; infinite where the data set no bound.

    Raises
    ------
    HydrostateError
        If the model is no output-error fit, or the level is not between 0 and 1.
    """
    if model.structure != "output-error" or not 0.0 < level < 1.0:
        raise HydrostateError(
            "a profile interval needs an output-error fit and a level between 0 and 1, "
            f"got {model.structure!r} and {level}"
        )
    n_b = model.numerator.size - model.delay
    form = Structure(n_b, model.denominator.size - 1, model.delay, estimate_initial_state)
    names = (model.input_name, model.output_name)
    data = experiments_from(u, y, names, n_excited=1, n_wanted=form.n_parameters).scaled()
    unit = data.y_scale / data.u_scale
    fitted = np.concatenate([model.numerator[model.delay :] / unit, model.denominator[1:]])
    starts = [fitted, *starting_values(form, data, OTHER_STARTS if model.cancellations else 1)]
    least, best = min((descend_from(form, start, data, 100) for start in starts), key=lambda found: found[0])
    variance = least / (data.n_used - best.size)
    # the fit chooses the place of a cancelled pole among many: one more degree of freedom for each
    freedom = 1 + len(model.cancellations)
    quantile = chi_square_quantile(level, freedom)
    allowed = least + quantile * variance * _variance_ratio(model)
    near = NEAR * (allowed / least - 1.0)
    gain = float(best[:n_b].sum() / (1.0 + best[n_b : n_b + form.n_denominator].sum()))
    first = max(model.dc_gain_std / unit, 1e-6 * abs(gain)) * chi_square_quantile(level, 1) ** 0.5
    others = [descend_from(form, start, data, 12)[1] for start in starts[1:]]

    def missed(value: float) -> Array | None:
        """Return the values of a fit from the first starts that chance explains at a gain; None if there is none."""
        forced = (_fit_with_gain(form, data, start, value, near) for start in others)
        return next((theta for cost, theta in forced if cost <= allowed), None)

    ends: list[float] = []
    for side in (-1.0, 1.0):
        basins = [best, *others]

        def excess(value: float, basins: list[Array] = basins) -> float:
            """Each basin is followed from one gain to the next; the last that chance explains comes first."""
            found = np.inf
            for place in range(len(basins)):
                cost, basins[place] = _fit_with_gain(form, data, basins[place], value, near)
                found = min(found, cost)
                if cost <= allowed:  # no better fit is needed
                    basins.insert(0, basins.pop(place))
                    break
            return found - allowed

        end, step = _crossing(excess, gain, side * first), side * first
        for _ in range(OTHER_STARTS):
            basin = missed(end) if np.isfinite(end) else None
            if basin is None:
                break
            basins.insert(0, basin)
            end = _crossing(excess, end, step)
        ends.append(end * unit)
    return ends[0], ends[1]


def _crossing(excess: Callable[[float], float], gain: float, step: float) -> float:
    """Return the gain, away from the fitted one, at which the excess becomes positive.

    It bisects, because the excess is not smooth: another minimum may become the best between two gains.
    """
    inside = gain
    for _ in range(WIDENINGS):
        outside = gain + step
        if excess(outside) > 0.0:
            break
        inside, step = outside, 1.6 * step
    else:
        return float(np.copysign(np.inf, step))
    for _ in range(BISECTIONS):
        middle = 0.5 * (inside + outside)
        inside, outside = (inside, middle) if excess(middle) > 0.0 else (middle, outside)
    return outside


def _variance_ratio(model: LinearModel) -> float:
    """Return the gain's variance over that of a white residual; 1 if both agree or are unknown."""
    plain = replace(model, covariance=model.covariance_white).dc_gain_std
    return (model.dc_gain_std / plain) ** 2 if plain > 0.0 and np.isfinite(model.dc_gain_std / plain) else 1.0


def _fit_with_gain(form: Structure, data: Experiments, start: Array, gain: float, near: float) -> tuple[float, Array]:
    """Return cost and values of the best fit with a given gain; the last numerator coefficient follows from the rest.

    It ends where a step promises less than ``near`` of the cost.

    The gain's condition ``sum b = gain (1 + sum f)`` is linear, so sensitivities of the free values are those of all
    values times one constant matrix.
    """
    n_b, n_f = form.n_numerator, form.n_denominator
    p = start.size
    free = np.delete(np.arange(p), n_b - 1)
    basis = np.eye(p)[:, free]
    basis[n_b - 1, : n_b - 1] = -1.0
    basis[n_b - 1, n_b - 1 : n_b - 1 + n_f] = gain
    weight = data.used.astype(np.float64)

    base = start.copy()
    base[n_b - 1] = gain * (1.0 + base[n_b : n_b + n_f].sum()) - base[: n_b - 1].sum()

    def at(moved: Array) -> tuple[float, Array, Array]:
        gram, gradient = np.zeros((p, p)), np.zeros(p)
        theta = base + basis @ moved
        cost = normal_equations(theta, form.sizes, data.u, data.y, weight, data.bounds, gram, gradient)
        whole = gram + np.tril(gram, -1).T
        return cost, np.ascontiguousarray(basis.T @ whole @ basis), basis.T @ gradient

    def acceptable(moved: Array) -> bool:
        return stable((base + basis @ moved)[n_b : n_b + n_f])

    cost, moved = levenberg(at, np.zeros(p - 1), acceptable, tolerance=near, most_steps=MOST_STEPS, slower=0.1)
    return cost, base + basis @ moved
