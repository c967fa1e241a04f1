"""Outputs that are a nonlinear function of a linear model's output: without its sign, saturated, or held by stops."""

from dataclasses import replace

import numpy as np

from estimation.identification.fit.feedback import feedback_note
from estimation.identification.free_run.absolute_dynamics import AbsoluteDynamics
from estimation.identification.free_run.absolute_output import refitted_absolute
from estimation.identification.free_run.candidate_rows import absolute_row, form_row
from estimation.identification.free_run.choose_absolute import (
    AbsoluteCandidate,
    absolute_candidates,
    chosen_absolute,
    may_lack_sign,
    relative_to_zero,
)
from estimation.identification.free_run.choose_limited import LimitedCandidate, limits_in_words, refitted_limited
from estimation.identification.free_run.data import liveliest_sections
from estimation.identification.free_run.identified import Identified
from estimation.identification.free_run.limited_dynamics import LimitedDynamics
from estimation.identification.free_run.limited_output import at_limits, between_limits
from estimation.identification.free_run.linear_comparison import LinearComparison
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.transfer_function import linear_model
from estimation.identification.notes import IdentificationCode
from plant.errors import HydrostateError
from plant.notes import Note

SIGNLESS_ERROR_RATIO = 0.5
"""Largest ratio of the held-back error without a sign to that of the linear model: many signs are fitted."""


def best_signless(linear: LinearComparison, most: int, *, surely: bool) -> AbsoluteCandidate | None:
    """Return the best model of an output without its sign; None if there is none, or a linear one is good enough.

    Parameters
    ----------
    linear : LinearComparison
        Models of the output as it is.
    most : int
        Samples on which nonlinear models are compared.
    surely : bool
        Whether it must be clearly better, since the user did not ask for it.

    Raises
    ------
    HydrostateError
        If one was asked for and there is none.
    """
    data, by = liveliest_sections(linear.task.whole, most), linear.task.by
    if surely and not may_lack_sign(data, by):
        return None
    found = absolute_candidates(data, by, linear.task.asked)
    linear.rows.extend(map(absolute_row, found))
    if not found and not surely:
        raise HydrostateError(f"no model of {data.output!r} without its sign has poles quicker than a held-back block")
    if not found:
        return None
    taken = chosen_absolute(found)
    # a block with the only step of the inputs says little, so the fit to all blocks must agree
    explains = taken.bic / data.n_samples < linear.best.bic / linear.task.part.n_samples
    return (
        None if surely and not (explains and taken.held_back < SIGNLESS_ERROR_RATIO * linear.best.held_back) else taken
    )


def identified_absolute(taken: AbsoluteCandidate, linear: LinearComparison, most: int, *, asked: bool) -> Identified:
    """Return a model whose output has no sign, fitted to all data.

    Parameters
    ----------
    taken : AbsoluteCandidate
        The chosen model.
    linear : LinearComparison
        Models of the output as it is.
    most : int
        Most samples that are fitted.
    asked : bool
        Whether the user asked for it; otherwise a note says that it was chosen.
    """
    data, by = linear.task.data, linear.task.by
    fit = refitted_absolute(taken.fit, relative_to_zero(liveliest_sections(linear.task.whole, most), by))
    model = FreeRunModel(data.inputs, data.output, data.sample_time, "wiener", by, AbsoluteDynamics.of(fit, taken.zero))
    found, left = (
        identified_with_quality(model, linear, taken.held_back),
        taken.held_back / max(linear.best.held_back, 1e-300),
    )
    said = () if asked else (IdentificationCode.SIGN_NOT_MEASURED.note(output=data.output, left=left),)
    return replace(found, notes=(*said, *found.notes))


def identified_limited(taken: LimitedCandidate, linear: LinearComparison) -> Identified:
    """Return a linear model whose output has limits, fitted to all data."""
    data, whole, by, limits = linear.task.data, linear.task.whole, linear.task.by, taken.limits
    fit = refitted_limited(taken, whole)
    kind = "stops" if limits.stops else "cut-off"
    linear.rows.append(form_row("output-error", taken, fit.form, nonlinearity=kind))
    # a stop erases the transfer function's own run, so no covariance follows from that run
    transfer = None if limits.stops or len(data.inputs) > 1 else linear_model(fit, between_limits(whole, limits), by)
    named = data.inputs, data.output, data.sample_time, "output-error"
    model = FreeRunModel(*named, by, LimitedDynamics.within(fit, limits), transfer)
    found, notes = identified_with_quality(model, linear, taken.held_back), list[Note]()
    shown, share = limits_in_words(whole, by, limits)
    told_by = {"output": data.output, "limits": shown, "share": share}
    if limits.stops:
        notes.append(IdentificationCode.OUTPUT_STOPPED.note(**told_by))
    else:
        notes.append(IdentificationCode.OUTPUT_CUT_OFF.note(**told_by))
    if taken.outlasts(whole.informative_samples):
        notes.append(IdentificationCode.INTEGRATES.note(output=data.output))
    if len(data.inputs) == 1:
        k = int(np.argmax([y.size for y in data.y]))
        left = np.where(at_limits(whole.y[k], limits), np.nan, data.y[k] - model.simulate(data.u[k], data.y[k]))
        said = feedback_note(left, data.u[k][:, 0], (data.inputs[0], data.output))
        notes += [] if said is None else [said]
    return replace(found, notes=(*notes, *found.notes))


def identified_with_quality(model: FreeRunModel, linear: LinearComparison, held_back: float) -> Identified:
    """Return a nonlinear model with its quality; it is not believed without one.

    Parameters
    ----------
    model : FreeRunModel
        Fitted to all data.
    linear : LinearComparison
        Linear models with which it was compared.
    held_back : float
        Its error on held-back blocks, over the output's deviation [dimensionless].
    """
    data = linear.task.data
    quality = model.quality(data.u, data.y)
    sound = quality.fit_percent > 0.0 and held_back < 1.0
    notes = () if sound else (IdentificationCode.NO_FIT.note(output=data.output, fit=quality.fit_percent),)
    return Identified(model, quality, 100.0 * (1.0 - held_back), tuple(linear.rows), notes, sound)
