"""What the first of two stages leaves uncertain counts in the second: its input is known only as well as that stage.

A model of the second stage follows an error of its input, so its residual does not show it. In a loop that integrates
this is most of the error of the steady gain.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.covariances import spread_of_fit
from estimation.identification.free_run.data import Channels, in_scale
from estimation.identification.free_run.identified import Identified
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_problem import Problem
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.notes import IdentificationCode


@dataclass(frozen=True, eq=False)
class Stage:
    """The model of an input by its references, and the channels that it was fitted to."""

    model: FreeRunModel
    drive: Channels


def with_first_stage(found: Identified, data: Channels, stages: Sequence[Stage]) -> Identified:
    """Return a linear model with the covariance that its inputs' uncertainty adds; others as they are.

    Parameters
    ----------
    data : Channels
        Inputs that references explain, and the output, in units of the channels.
    stages : sequence of Stage
        One an input.
    """
    model, dynamics = found.model, found.model.dynamics
    walks = any(note.code == IdentificationCode.RANDOM_WALK for note in found.notes)
    if walks or not isinstance(dynamics, LinearDynamics):
        return found
    form = dynamics.form
    added = _added_covariance(dynamics, in_scale(data, model.scaling), model.scaling.u_std, stages)
    transfer, by = model.linear, model.scaling
    if transfer is not None:
        unit = by.y_std / float(by.u_std[0])
        unscale = np.concatenate([np.full(form.n_b, unit), np.ones(form.order)])
        more = added * np.outer(unscale, unscale)
        names = ("covariance", "covariance_white", "covariance_robust")
        wider = replace(transfer, **{name: getattr(transfer, name) + more for name in names})
        return replace(found, model=replace(model, linear=wider))
    slopes = dynamics.gain_slopes() * (by.y_std / by.u_std)[:, None]
    variances = np.einsum("ij,jk,ik->i", slopes, added, slopes)
    gains = tuple(float(np.hypot(std, more**0.5)) for std, more in zip(found.gain_std, variances, strict=False))
    return replace(found, gain_std=gains)


def _added_covariance(dynamics: LinearDynamics, data: Channels, u_std: Array, stages: Sequence[Stage]) -> Array:
    """Return the covariance of numerators and denominator that errors of the inputs add, in the data's scale."""
    form = dynamics.form
    problem = Problem(form, data)
    _, jacobian = problem.jacobian(problem.profiled(dynamics.f)[1])
    jacobian[~problem.used] = 0.0
    n_main = form.n_b + form.order
    answer = np.linalg.pinv(jacobian)[:n_main]
    added = np.zeros((n_main, n_main))
    for index, stage in enumerate(stages):
        for moved in _input_deviations(stage):
            inputs = [np.zeros(u.shape) for u in data.u]
            for one, change in zip(inputs, np.split(moved, problem.bounds[1:-1]), strict=True):
                one[:, index] = change / u_std[index]
            driven = Problem(form, replace(data, u=tuple(inputs))).linear_columns(dynamics.f)
            shift = answer @ np.where(problem.used, driven[:, : form.n_b] @ dynamics.theta[: form.n_b], 0.0)
            added += np.outer(shift, shift)
    return added


def _input_deviations(stage: Stage) -> list[Array]:
    """Return independent deviations of an explained input, of one standard deviation each [input unit]."""
    model, dynamics = stage.model, stage.model.dynamics
    if not isinstance(dynamics, LinearDynamics):
        return []
    problem = Problem(dynamics.form, in_scale(stage.drive, model.scaling))
    output, jacobian = problem.jacobian(problem.profiled(dynamics.f)[1])
    residual = np.where(problem.used, problem.y - output, 0.0)
    columns = jacobian.copy()
    spread = spread_of_fit(jacobian, residual, problem.used, problem.bounds.astype(np.int64)).taken
    felt = np.isfinite(np.diag(spread))
    values, directions = np.linalg.eigh(spread[np.ix_(felt, felt)])
    ways = directions * np.sqrt(np.maximum(values, 0.0))
    return list((columns[:, felt] @ ways).T * model.scaling.y_std)
