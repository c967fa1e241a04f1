"""Whether a model of the error is added to the model that ``auto`` chose, or to the linear one in its place."""

from dataclasses import replace

import numpy as np

from estimation.identification.free_run.data import Channels, in_scale, liveliest_sections
from estimation.identification.free_run.error_model import error_model_of
from estimation.identification.free_run.fallback import linear_stands_in
from estimation.identification.free_run.hammerstein_dynamics import HammersteinDynamics
from estimation.identification.free_run.identified import Identified
from estimation.identification.free_run.linear_comparison import LinearComparison
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.notes import CLOSED_LOOP, IdentificationCode

CORRECTED = (LinearDynamics, PolynomialDynamics, HammersteinDynamics)
"""Dynamics whose error is modelled: an output with limits or without a sign would leave them."""

MOST_MODELLED = 10_000
"""Samples from which an error model is fitted, as linear models are compared [count]."""


def likelier_with_error_model(found: Identified, linear: LinearComparison) -> Identified:
    """Return a result with a model of its error, or the linear model with its own if held-back blocks prefer that.

    Parameters
    ----------
    found : Identified
        What ``auto`` chose.
    linear : LinearComparison
        Linear models of the same data.
    """
    own = _with_error_model(found, linear.task.data)
    if found.model.structure == "output-error":
        return own
    straight = _with_error_model(linear.identified(), linear.task.data)
    better = straight.model.error_model is not None and straight.held_back_percent > own.held_back_percent
    return straight if better else own


def _with_error_model(found: Identified, data: Channels) -> Identified:
    """Return a result with a model of its error; as it is if there is none, or it is not to be believed.

    Behind a controller the inputs follow the output's noise, and would predict it. Where a linear model stands in for a
    nonlinear one, the error is not that model's.
    """
    model = found.model
    fed = any(note.code in CLOSED_LOOP for note in found.notes)
    if type(model.dynamics) not in CORRECTED or not found.sound or fed:
        return found
    part, by = liveliest_sections(in_scale(data, model.scaling), MOST_MODELLED), model.scaling
    runs = [
        model.free_run(by.u_mean + by.u_std * u, by.y_mean + by.y_std * y) for u, y in zip(part.u, part.y, strict=True)
    ]
    if any(linear_stands_in(run.errors) or not np.isfinite(run.output).all() for run in runs):
        return found
    scaled = [(run.output - by.y_mean) / by.y_std for run in runs]
    error_model = error_model_of(scaled, part, [model.dynamics.undetermined_outputs(y.size) for y in part.y])
    if error_model is None:
        return found
    model, left = replace(model, error_model=error_model), error_model.error / error_model.plain_error
    held_back = 100.0 - left * (100.0 - found.held_back_percent)
    row = {
        "structure": model.structure,
        "error_model": error_model.facts(),
        "held_back_percent": held_back,
        "bic": None,
    }
    note = IdentificationCode.ERROR_MODELLED.note(
        output=data.output, structure=model.structure, left=left, earlier=max(error_model.lags) * model.sample_time
    )
    return replace(
        found,
        model=model,
        quality=model.quality(data.u, data.y),
        held_back_percent=held_back,
        candidates=(*found.candidates, row),
        notes=(*found.notes, note),
    )
