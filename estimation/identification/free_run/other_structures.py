"""Structures that are not fitted by their free run: they get an offset, and are judged by the free run."""

from dataclasses import replace

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.identification.choose import fit_structure
from estimation.identification.free_run.data import Channels, Scaling, in_scale
from estimation.identification.free_run.held_back import block_error
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_problem import Form, Problem
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.structure_names import STRUCTURE_NAMES
from plant.errors import HydrostateError

OTHER_STRUCTURES = {name: structure for name, structure in STRUCTURE_NAMES.items() if name != "output-error"}
"""Structures that are not fitted by their free run, by their names in the command line."""

HELD_BACK = 1.0 / 3.0
"""Last share of every log that is held back to judge the structure."""


def fit_other_structure(
    name: str, form: Form, data: Channels, by: Scaling
) -> tuple[LinearDynamics, LinearModel, float]:
    """Fit a structure, and judge it by the free run on the last third of every log, fitted to the rest.

    Parameters
    ----------
    name : str
        One of `OTHER_STRUCTURES`.
    form : Form
        Order, size and dead time.
    data : Channels
        In the channels' units.

    Returns
    -------
    tuple of LinearDynamics, LinearModel and float
        The dynamics, the fit with its offset, and the held-back error over the output's deviation.

    Raises
    ------
    HydrostateError
        If there are several inputs, or as the fits.
    """
    if len(data.inputs) > 1:
        raise HydrostateError(f"structure {name} takes one input, got {', '.join(data.inputs)}: use output-error")
    model = _model_fit(name, form, data, by)
    dynamics, offset = _free_run_dynamics(model, data, by)
    cuts = [round(y.size * (1.0 - HELD_BACK)) for y in data.y]
    shorter = replace(
        data,
        u=tuple(u[:cut] for u, cut in zip(data.u, cuts, strict=True)),
        y=tuple(y[:cut] for y, cut in zip(data.y, cuts, strict=True)),
    )
    part, _ = _free_run_dynamics(_model_fit(name, form, shorter, by), shorter, by)
    whole = in_scale(data, by)
    errors, masks = list[Array](), list[BoolArray]()
    for u, y, cut in zip(whole.u, whole.y, cuts, strict=True):
        late = np.arange(y.size) >= cut
        errors.append(part.run(u, np.where(late, np.nan, y)) - y)
        masks.append(late & np.isfinite(y))
    held_back = block_error(np.concatenate(errors), np.concatenate(masks))
    level = by.y_mean + by.y_std * offset
    if not model.continuous:
        level -= model.dc_gain * float(by.u_mean[0])
    else:
        level -= float(model.numerator[-1] / model.denominator[-1]) * float(by.u_mean[0])
    return dynamics, replace(model, offset=level), held_back


def _model_fit(name: str, form: Form, data: Channels, by: Scaling) -> LinearModel:
    u = [one[:, 0] - by.u_mean[0] for one in data.u]
    y = [one - by.y_mean for one in data.y]
    if name in ("subspace", "instrumental") and any(np.isnan(one).any() for one in y):
        raise HydrostateError(f"structure {name} needs every sample of {data.output!r}: use output-error")
    if name == "subspace" and len(u) > 1:
        raise HydrostateError(f"structure subspace takes one log, got {len(u)}: use output-error")
    sizes = {"n_numerator": form.sizes[0], "n_denominator": form.order, "delay": form.delays[0]}
    about = {"covariance": "auto", "input_name": data.inputs[0], "output_name": data.output}
    both = (u[0], y[0]) if len(u) == 1 else (u, y)
    return fit_structure(OTHER_STRUCTURES[name], *both, data.sample_time, {**sizes, **about})


def _free_run_dynamics(model: LinearModel, data: Channels, by: Scaling) -> tuple[LinearDynamics, float]:
    """Return the free-run dynamics of a fit, with the offset that fits the data best."""
    if not model.is_stable:
        raise HydrostateError(
            f"the {model.structure} model of {data.output!r} is unstable and does not run free: use output-error"
        )
    one = model.discretised() if model.continuous else model
    b = one.numerator[one.delay :] * float(by.u_std[0]) / by.y_std
    form = Form(one.denominator.size - 1, (b.size,), (one.delay,))
    problem = Problem(form, in_scale(data, by))
    columns = problem.linear_columns(one.denominator)
    left = (problem.y - columns[:, : b.size] @ b)[problem.used]
    offset = float(np.linalg.lstsq(columns[:, b.size :][problem.used], left, rcond=None)[0][0])
    return LinearDynamics(form, np.concatenate([b, one.denominator[1:], [offset]])), offset
