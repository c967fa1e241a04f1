"""From channels to the model that generalises: candidates judged by free runs on blocks held back."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from estimation.identification.fit.feedback import feedback_note
from estimation.identification.free_run.absolute_dynamics import AbsoluteDynamics
from estimation.identification.free_run.absolute_output import refitted_absolute
from estimation.identification.free_run.believable import believable
from estimation.identification.free_run.candidate_rows import (
    absolute_row,
    hammerstein_row,
    linear_row,
    polynomial_row,
)
from estimation.identification.free_run.choose_absolute import (
    AbsoluteCandidate,
    absolute_candidates,
    chosen_absolute,
    from_zero,
    may_lack_sign,
)
from estimation.identification.free_run.choose_hammerstein import (
    HammersteinCandidate,
    hammerstein_candidates,
    worthwhile,
)
from estimation.identification.free_run.choose_linear import Candidate, linear_candidates
from estimation.identification.free_run.choose_polynomial import PolynomialCandidate, polynomial_candidates
from estimation.identification.free_run.data import (
    Channels,
    Scaling,
    blocks,
    require_room,
    require_size,
    scaled,
    section,
)
from estimation.identification.free_run.dense_polynomial import Asked
from estimation.identification.free_run.doubtful_channels import doubtful_channels
from estimation.identification.free_run.fallback import Fallback
from estimation.identification.free_run.fewer_samples import on_fewer
from estimation.identification.free_run.hammerstein_dynamics import HammersteinDynamics
from estimation.identification.free_run.hammerstein_fit import deviations, finished, refitted
from estimation.identification.free_run.held_back import BLOCKS
from estimation.identification.free_run.identified import Identified
from estimation.identification.free_run.integrating import refitted_linear
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_fit import COARSE
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.other_structures import ADOPTED, adopt
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.free_run.random_walk import from_changes, wandering
from estimation.identification.free_run.transfer_function import linear_model
from estimation.identification.free_run.unrelated import bend_explains, linear_explains, polynomial_explains
from estimation.identification.notes import IdentificationCode
from plant.errors import HydrostateError, LogWarning, require_known
from plant.notes import Note

FREE_STRUCTURES = ("output-error", "narx", "hammerstein", "wiener", "auto", *ADOPTED)
"""Structures between any channels; auto chooses between the first four."""

WARNED = (
    IdentificationCode.TIME_CONSTANT_BEYOND_RECORD,
    IdentificationCode.NO_FIT,
    IdentificationCode.UNRELATED,
    IdentificationCode.INTEGRATES,
    IdentificationCode.SLOWER_THAN_PERIOD,
    IdentificationCode.SIGN_NOT_MEASURED,
    IdentificationCode.FEEDBACK,
    IdentificationCode.INPUTS_ALIKE,
    IdentificationCode.OUTLIERS,
    IdentificationCode.RANDOM_WALK,
)
"""Notes that are raised as warnings too; the others say only what was passed over."""

HIGHEST = 6
"""Order of a linear model at most, where the data choose."""

MOST_CHOSEN, MOST_COMPARED, MOST_FITTED = 10_000, 5_000, 100_000
"""Samples on which linear models are compared, on which nonlinear ones are compared with them, and on which a nonlinear
model is fitted at the end."""

SIGNLESS = 0.5
"""Share of the linear model's held-back error that a model without a sign may leave: signs that are told are many."""

ROUNDING = 1e-9
"""Held-back error of a linear model below which nothing is left but rounding: no bend is looked for [dimensionless]."""

CLEAR_MARGIN = 0.15
"""Share by which a nonlinear model must do better than the linear one on what was held back."""


def identify_channels(
    data: Channels,
    *,
    structure: str = "output-error",
    order: int | None = None,
    delay: int | None = None,
    n_numerator: int | None = None,
) -> Identified:
    """Identify the relation from inputs to one output, with offset, initial states and what the data say of both.

    Parameters
    ----------
    data : Channels
        One log or several.
    structure : str
        ``"output-error"``: linear; ``"narx"``: polynomial, its terms chosen by the free run; ``"auto"``: linear,
        unless the polynomial one is clearly better on blocks held back, or of one input the next. Of one input also
        ``"hammerstein"``: a dead zone, saturation or backlash in front of a linear model, where one of them is better
        there than none; and the keys of `other_structures.ADOPTED`, at the order that output error is given.
        ``"wiener"``: linear, its output measured without a sign; of outputs that may be, ``"auto"`` tries it too.
        Where the output wanders by itself, ``"output-error"`` and ``"auto"`` fit a linear model to changes from sample
        to sample (`random_walk`).
    order, delay, n_numerator : int, optional
        Of every input; chosen by the free run on blocks held back where not given.

    Returns
    -------
    Identified
        Model, quality and candidates.

    Raises
    ------
    HydrostateError
        If the structure is not known or nothing can be fitted.

    Warns
    -----
    LogWarning
        If the model is not to be believed, or its steady gain means nothing.
    """
    require_known("structure", structure, FREE_STRUCTURES)
    require_size(order, delay, n_numerator)
    require_room(data, order, delay, n_numerator)
    with threadpool_limits(limits=1, user_api="blas"):
        found = _identified(data, structure, order, delay, n_numerator)
    found = replace(found, notes=(*found.notes, *doubtful_channels(found.model, data)))
    for note in found.notes:
        if note.code in WARNED:
            warnings.warn(LogWarning(note), stacklevel=2)
    return found


def _identified(
    data: Channels, structure: str, order: int | None, delay: int | None, n_numerator: int | None
) -> Identified:
    whole, by = scaled(data)
    part = section(whole, MOST_CHOSEN)
    orders = range(1, HIGHEST + 1) if order is None else (order,)
    delays = None if delay is None else (delay,) * len(data.inputs)
    if structure in ("output-error", "auto"):
        walk = wandering(whole, part, list(orders), delays, n_numerator)
        if walk is not None:
            return from_changes(walk, data, by)
    linear = linear_candidates(part, list(orders), delays, n_numerator)
    best, notes = believable(linear, part, by)
    rows = [linear_row(one) for one in linear]
    related = not best.outlasts_block(part) or linear_explains(best.fit, part)
    notes = notes if related else [IdentificationCode.UNRELATED.note(output=data.output)]
    sound = related and not best.doubt
    if structure in ADOPTED:
        return _adopted(structure, best, data, by, rows, [] if related else notes)
    if structure == "auto" and best.held_back < ROUNDING:
        structure = "output-error"
    asked = Asked(order, delay, n_numerator)
    if structure in ("output-error", "auto", "wiener"):
        signless = _without_sign(section(whole, MOST_COMPARED), by, asked, best, rows, surely=structure != "wiener")
        if signless is not None and structure != "output-error":
            return _absolute(signless, data, whole, rows)
        if signless is not None:
            left = signless.held_back / best.held_back
            notes = [*notes, IdentificationCode.SIGN_NOT_MEASURED.note(output=data.output, left=left)]
    compared, judged, own = part, linear, best
    if structure != "output-error":
        # a whole period, where there is one: a shorter section would say nothing of what is slower than itself
        most = max(MOST_COMPARED, part.told) if part.told < part.longest else MOST_COMPARED
        compared, judged, own = on_fewer(linear, best, part, section(whole, most))
    nonlinear = None
    if structure == "hammerstein" or (structure == "auto" and len(data.inputs) == 1):
        nonlinear = _worthwhile_nonlinearity(judged, own, compared, rows, surely=structure == "auto")
        if nonlinear is not None and not related and not bend_explains(nonlinear.fit, compared):
            nonlinear = None
    if structure == "hammerstein":
        if nonlinear is not None:
            return _nonlinear(nonlinear, data, whole, rows)
        notes = [*notes, IdentificationCode.NO_NONLINEARITY.note(output=data.output)]
        structure = "output-error"
    dynamics, held_back, named = LinearDynamics.of(best.fit), best.held_back, "output-error"
    if structure != "output-error":
        straight = min([own, *(one for one in judged if not one.doubt)], key=lambda one: one.held_back)
        bar = (1.0 - CLEAR_MARGIN) * straight.held_back if structure == "auto" and sound else float("inf")
        bar = bar if nonlinear is None else min(bar, nonlinear.held_back)
        polynomial = polynomial_candidates([own] if own.doubt else judged, compared, asked, bar)
        rows += [polynomial_row(one) for one in polynomial]
        better = min(polynomial, key=lambda one: (one.price, one.held_back), default=None)
        if better is None and structure == "narx":
            raise HydrostateError(f"no polynomial model of {data.output!r} runs free without growing beyond bounds")
        taken = better is not None and (structure == "narx" or not sound or _clearly_better(better, straight))
        if nonlinear is not None and not (taken and better is not None and better.price < nonlinear.held_back):
            stands_in = _fallback(nonlinear, own, compared, whole) if structure == "auto" and sound else None
            return _nonlinear(nonlinear, data, whole, rows, stands_in)
        if taken and better is not None:
            dynamics, held_back, named = _refitted(better, whole), better.held_back, "narx"
            if structure == "auto" and sound:
                dynamics = replace(dynamics, fallback=_fallback(better, own, compared, whole))
            related = related or polynomial_explains(better, compared)
            notes = [] if related else [IdentificationCode.UNRELATED.note(output=data.output)]
            sound = related and np.isfinite(held_back) and held_back < 1.0
    transfer = None
    if isinstance(dynamics, LinearDynamics):
        fit = refitted_linear(best.fit, whole)
        # fitted on, a model with a pole at 1 may come where it cannot be written: what was judged stays
        fit = best.fit if part is whole and not fit.cost <= best.fit.cost else fit
        dynamics = LinearDynamics.of(fit)
        transfer = linear_model(fit, whole, by) if len(data.inputs) == 1 else None
    model = FreeRunModel(data.inputs, data.output, data.sample_time, named, by, dynamics, transfer)
    quality = model.quality(data.u, data.y)
    notes = [*notes, *_fed_back(model, data)]
    empty = isinstance(dynamics, LinearDynamics) and best.doubt == "no_fit"
    if empty or not quality.fit_percent > 0.0 or not held_back < 1.0:
        notes = [*notes, IdentificationCode.NO_FIT.note(output=data.output, fit=quality.fit_percent)]
        sound = False
    return Identified(model, quality, 100.0 * (1.0 - held_back), tuple(rows), tuple(notes), bool(sound))


def _fed_back(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return a note where the input of a linear model follows the output's noise, by the longest log."""
    if len(data.inputs) != 1 or not isinstance(model.dynamics, LinearDynamics):
        return []
    k = int(np.argmax([y.size for y in data.y]))
    u, y = data.u[k], data.y[k]
    said = feedback_note(y - model.simulate(u, y), u[:, 0], (data.inputs[0], data.output))
    return [] if said is None else [said]


def _worthwhile_nonlinearity(
    linear: Sequence[Candidate], best: Candidate, data: Channels, rows: list[dict[str, Any]], *, surely: bool
) -> HammersteinCandidate | None:
    """Return the best model with a nonlinearity at its input, or None where none is better than every linear one."""
    if len(data.inputs) > 1:
        raise HydrostateError(f"structure hammerstein takes one input, got {', '.join(data.inputs)}: use narx")
    found = hammerstein_candidates(linear, data)
    rows += [hammerstein_row(one) for one in found]
    return worthwhile(found, linear, best, surely=surely)


def _nonlinear(
    taken: HammersteinCandidate,
    data: Channels,
    whole: Channels,
    rows: list[dict[str, Any]],
    fallback: Fallback | None = None,
) -> Identified:
    """Return a model with a nonlinearity at its input, fitted to all data."""
    part = section(whole, MOST_FITTED)
    # on the data of the comparison a start elsewhere might lead to a model that no block has judged
    fit = finished(taken.fit, whole) if section(whole, MOST_COMPARED) is whole else refitted(taken.fit, part)
    dynamics = replace(HammersteinDynamics.of(fit, deviations(fit, part)), fallback=fallback)
    model = FreeRunModel(data.inputs, data.output, data.sample_time, "hammerstein", scaled(data)[1], dynamics)
    return _told(model, data, taken.held_back, rows)


def _told(model: FreeRunModel, data: Channels, held_back: float, rows: list[dict[str, Any]]) -> Identified:
    """Return a nonlinear model with its quality, not to be believed where it has none."""
    quality = model.quality(data.u, data.y)
    sound = quality.fit_percent > 0.0 and held_back < 1.0
    notes = () if sound else (IdentificationCode.NO_FIT.note(output=data.output, fit=quality.fit_percent),)
    return Identified(model, quality, 100.0 * (1.0 - held_back), tuple(rows), notes, sound)


def _without_sign(
    data: Channels, by: Scaling, asked: Asked, best: Candidate, rows: list[dict[str, Any]], *, surely: bool
) -> AbsoluteCandidate | None:
    """Return the best model of a size whose sign is not measured; None where there is none, or a linear one will do."""
    if surely and not may_lack_sign(data, by):
        return None
    found = absolute_candidates(data, by, asked)
    rows += [absolute_row(one) for one in found]
    if not found and not surely:
        raise HydrostateError(f"no model of {data.output!r} without its sign has poles quicker than a held-back block")
    if not found:
        return None
    taken = chosen_absolute(found)
    return None if surely and not taken.held_back < SIGNLESS * best.held_back else taken


def _absolute(taken: AbsoluteCandidate, data: Channels, whole: Channels, rows: list[dict[str, Any]]) -> Identified:
    """Return a model whose output has no sign, fitted to all data."""
    by = scaled(data)[1]
    fit = refitted_absolute(taken.fit, from_zero(section(whole, MOST_FITTED), by))
    model = FreeRunModel(data.inputs, data.output, data.sample_time, "wiener", by, AbsoluteDynamics.of(fit, taken.zero))
    return _told(model, data, taken.held_back, rows)


def _adopted(
    structure: str, best: Candidate, data: Channels, by: Scaling, rows: list[dict[str, Any]], said: Sequence[Note]
) -> Identified:
    """Return a structure that is not fitted by its free run, at the order of the best output-error model."""
    dynamics, linear, held_back = adopt(structure, best.form, data, by)
    model = FreeRunModel(data.inputs, data.output, data.sample_time, structure, by, dynamics, linear)
    quality = model.quality(data.u, data.y)
    sound = quality.fit_percent > 0.0 and held_back < 1.0
    notes = said if sound else [*said, IdentificationCode.NO_FIT.note(output=data.output, fit=quality.fit_percent)]
    return Identified(model, quality, 100.0 * (1.0 - held_back), tuple(rows), tuple(notes), sound and not said)


def _clearly_better(nonlinear: PolynomialCandidate, linear: Candidate) -> bool:
    """Return whether a nonlinear model wins by a margin over all blocks, and in half of them at least."""
    pairs = [
        (one, other)
        for one, other in zip(nonlinear.block_errors, linear.block_errors, strict=True)
        if not (np.isnan(one) or np.isnan(other))
    ]
    won = sum(one < other for one, other in pairs)
    return nonlinear.price < (1.0 - CLEAR_MARGIN) * linear.held_back and 2 * won >= len(pairs)


def _refitted(found: PolynomialCandidate, whole: Channels) -> PolynomialDynamics:
    """Return a polynomial dynamics fitted to all data, or to as much as is practical."""
    return PolynomialDynamics.of(found.refit(section(whole, MOST_FITTED)) or found.fit)


def _fallback(
    taken: PolynomialCandidate | HammersteinCandidate, linear: Candidate, part: Channels, whole: Channels
) -> Fallback:
    """Return the fallback for inputs that do not determine a nonlinear model."""
    masks = blocks(part, BLOCKS)
    others = tuple(LinearDynamics.of(refitted_linear(linear.fit, part.without(mask))) for mask in masks)
    share = part.n_samples / max(part.n_samples, section(whole, MOST_FITTED).n_samples)
    straight = LinearDynamics.of(refitted_linear(linear.fit, whole))
    if isinstance(taken, PolynomialCandidate):
        return Fallback(straight, others, tuple(map(PolynomialDynamics.of, taken.parts)), linear.held_back, share)
    fits = [refitted(taken.fit, part.without(mask), COARSE) for mask in masks]
    parts = tuple(HammersteinDynamics.of(fit, np.full(fit.values.size, np.nan)) for fit in fits)
    return Fallback(straight, others, parts, linear.held_back, share, taken.held_back)
