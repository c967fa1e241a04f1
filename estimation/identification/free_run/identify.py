"""From channels to the model that generalises: candidates judged by free runs on held-back blocks."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from estimation.identification.free_run.candidate_rows import hammerstein_row, polynomial_row
from estimation.identification.free_run.choose_error_model import likelier_with_error_model
from estimation.identification.free_run.choose_hammerstein import (
    HammersteinCandidate,
    hammerstein_candidates,
    worthwhile_candidate,
)
from estimation.identification.free_run.choose_limited import limited_candidate
from estimation.identification.free_run.choose_linear import Candidate
from estimation.identification.free_run.choose_polynomial import PolynomialCandidate, polynomial_candidates
from estimation.identification.free_run.data import (
    Channels,
    blocks,
    liveliest_sections,
    require_room,
    require_size,
    scaled,
)
from estimation.identification.free_run.dead_times import late_response_notes
from estimation.identification.free_run.dense_polynomial import RequestedSizes
from estimation.identification.free_run.doubtful_channels import doubtful_channels, residual_notes, wandering_notes
from estimation.identification.free_run.fallback import Fallback
from estimation.identification.free_run.fewer_samples import on_fewer_samples
from estimation.identification.free_run.hammerstein_dynamics import HammersteinDynamics
from estimation.identification.free_run.hammerstein_fit import deviations, finished_fit, refitted_hammerstein
from estimation.identification.free_run.held_back import BLOCKS, CLEAR_MARGIN
from estimation.identification.free_run.identified import Identified
from estimation.identification.free_run.integrating import refitted_linear
from estimation.identification.free_run.linear_comparison import (
    LinearComparison,
    Task,
    closed_loop_notes,
    linear_comparison,
    with_closed_loop_notes,
)
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_fit import COARSE
from estimation.identification.free_run.log_offsets import are_offsets_believed, logs_at_one_offset
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.nonlinear_outputs import (
    best_signless,
    identified_absolute,
    identified_limited,
    identified_with_quality,
)
from estimation.identification.free_run.other_structures import OTHER_STRUCTURES, identified_other_structure
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.free_run.random_walk import identified_walk, walk_followed_notes, walk_model
from estimation.identification.free_run.trend import detrended
from estimation.identification.free_run.unrelated import bend_explains, polynomial_explains
from estimation.identification.notes import CLOSED_LOOP, RAISED_AS_WARNINGS, IdentificationCode
from plant.errors import HydrostateError, LogWarning, require_known
from plant.notes import Note

FREE_STRUCTURES = ("output-error", "narx", "hammerstein", "wiener", "auto", *OTHER_STRUCTURES)
"""Structures between any channels; auto chooses between the first four."""

HIGHEST_ORDER = 6
"""Highest order of a linear model if the data choose."""

MOST_CHOSEN, MOST_COMPARED, MOST_FITTED = 10_000, 5_000, 100_000
"""Samples on which linear models are compared, on which nonlinear ones are compared with them, and on which a nonlinear
model is finally fitted."""

ROUNDING_ERROR = 1e-9
"""Held-back error of a linear model below which only rounding is left: no nonlinearity is tried [dimensionless]."""


def identify_channels(
    data: Channels,
    *,
    structure: str = "output-error",
    order: int | None = None,
    delay: int | None = None,
    n_numerator: int | None = None,
) -> Identified:
    """Identify the relation from inputs to one output, with offset, initial states and their uncertainty.

    Parameters
    ----------
    data : Channels
        One log or several.
    structure : str
        ``"output-error"``: linear. ``"narx"``: polynomial, with terms chosen by the free run. ``"hammerstein"``, for
        one input: a dead zone, saturation or backlash before a linear model, if one of them is better than none.
        ``"wiener"``: linear, with its output measured without a sign. ``"auto"``: linear, unless one of the others is
        clearly better on held-back blocks, and with an error model where that surely helps. Further the keys of
        `other_structures.OTHER_STRUCTURES`, at the order of the output-error model. ``"output-error"`` and ``"auto"``
        also recognise an output without its sign, limits at which the output stays, and an output with a random walk,
        which is fitted to changes from sample to sample (`random_walk`).
    order, delay, n_numerator : int, optional
        For every input; if not given, chosen by the free run on held-back blocks.

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
    flat = found.at_one_offset(data)
    found = replace(found, notes=(*found.notes, *doubtful_channels(found.model, flat)))
    found = _with_doubts(found, flat, structure, looked_for=delay is None)
    for note in found.notes:
        if note.code in RAISED_AS_WARNINGS:
            warnings.warn(LogWarning(note), stacklevel=2)
    return found


def _with_doubts(found: Identified, data: Channels, structure: str, *, looked_for: bool) -> Identified:
    """Return the result with notes on a random walk that it follows, and on dead times that were not searched."""
    whole, by = scaled(data)
    part, notes = liveliest_sections(whole, MOST_CHOSEN), list[Note]()
    if structure in ("narx", "hammerstein", "wiener"):
        notes += walk_followed_notes(whole, part, range(1, HIGHEST_ORDER + 1), structure)
    elif looked_for and not any(note.code == IdentificationCode.RANDOM_WALK for note in found.notes):
        notes += late_response_notes(part, found.quality.rmse / by.y_std)
    if structure == "auto" and found.model.structure != "output-error":
        notes += wandering_notes(found.model, data)
    doubtful, walks = bool(notes), any(note.code == IdentificationCode.RANDOM_WALK for note in found.notes)
    fed = any(note.code in CLOSED_LOOP for note in found.notes)
    if structure == "output-error" and found.sound and not (doubtful or walks or fed):
        notes += residual_notes(found.model, data)
        # a model without a sign replaces an unreliable linear one, so it must not leave more than noise
        doubtful = bool(notes) and found.model.structure != "output-error"
    return replace(found, notes=(*found.notes, *notes), sound=found.sound and not doubtful)


def _identified(
    data: Channels, structure: str, order: int | None, delay: int | None, n_numerator: int | None
) -> Identified:
    """Return the model: of changes if the output has a random walk, otherwise linear, or of the requested structure."""
    whole, by = scaled(data)
    orders = list(range(1, HIGHEST_ORDER + 1)) if order is None else [order]
    delays = None if delay is None else (delay,) * len(data.inputs)
    asked = RequestedSizes(order, delay, n_numerator)
    task = Task(data, whole, by, liveliest_sections(whole, MOST_CHOSEN), asked, orders, delays)
    given = structure in ("output-error", "auto")
    walk, closed = _identified_from_changes(task) if given else (None, [])
    if walk is not None and structure == "output-error":
        return walk
    linear = linear_comparison(task)
    linear.notes.extend(closed)
    if walk is not None:
        return _clearly_better_nonlinear(walk, linear, structure)
    if given and (apart := _identified_at_other_levels(task, linear)) is not None:
        return _clearly_better_nonlinear(apart[0], linear, structure, apart[1])
    if structure in OTHER_STRUCTURES:
        return identified_other_structure(structure, linear)
    if structure == "auto" and linear.best.held_back < ROUNDING_ERROR:
        structure = "output-error"
    wanted = structure == "wiener"
    if given or wanted:
        signless, within = best_signless(linear, MOST_COMPARED, surely=not wanted), None
        if not wanted:
            within = limited_candidate(linear)
        if signless is not None and (within is None or signless.held_back < within.held_back):
            return identified_absolute(signless, linear, MOST_FITTED, asked=wanted)
        if within is not None:
            held = identified_limited(within, linear)
            if held.sound:
                return _clearly_better_nonlinear(held, linear, structure)
    if structure == "output-error":
        return linear.identified()
    found = _nonlinear_or_linear(structure, linear)
    found = likelier_with_error_model(found, linear) if structure == "auto" else found
    return with_closed_loop_notes(found, linear)


def _identified_from_changes(task: Task) -> tuple[Identified | None, list[Note]]:
    """Return the linear model of an output with a random walk, None if it has none; and notes on a closed loop."""
    walk, free = walk_model(task.whole, task.part, task.orders, task.delays, task.asked.n_numerator), task.free
    if walk is not None and free is not None and walk_model(free.whole, free.part, free.orders, None, None) is None:
        return None, []
    found = None if walk is None else identified_walk(walk, task.data, task.by)
    # a controller that responds to the output's noise biases a fit of changes more than one of levels
    closed = [] if found is None else closed_loop_notes(found.model, task.data, changes=True)
    return None if closed else found, closed


def _identified_at_other_levels(task: Task, linear: LinearComparison) -> tuple[Identified, float] | None:
    """Return the linear model of logs brought to one offset, or without their trend; None if there is none.

    Also the deviation of that output [its unit].
    """
    data, orders, delays = task.data, task.orders, task.delays
    apart = logs_at_one_offset(data, orders, delays)
    if apart is not None:
        whole, by = scaled(apart.data)
        part = liveliest_sections(whole, MOST_CHOSEN)
        own = linear_comparison(replace(task, data=apart.data, whole=whole, by=by, part=part))
        if are_offsets_believed(own, linear):
            own.notes.append(apart.note)
            return replace(own.identified(), above=tuple(apart.above.tolist())), by.y_std
    drift = detrended(linear, orders)
    if drift is None:
        return None
    return replace(drift.linear.identified(), above=drift.trends), drift.linear.task.by.y_std


def _clearly_better_nonlinear(
    found: Identified, linear: LinearComparison, structure: str, std: float | None = None
) -> Identified:
    """Return the result, or for ``auto`` a nonlinear model with a clearly smaller held-back error.

    Errors are over the deviation of the output on which each was judged, which is ``std`` for the result.
    """
    if structure != "auto":
        return found
    other = _nonlinear_or_linear(structure, linear)
    left, own = (100.0 - one.held_back_percent for one in (other, found))
    own *= 1.0 if std is None else std / linear.task.by.y_std
    better = other.model.structure != "output-error" and left < (1.0 - CLEAR_MARGIN) * own
    return with_closed_loop_notes(other, linear) if better else found


def _nonlinear_or_linear(structure: str, linear: LinearComparison) -> Identified:
    """Return a nonlinear model, or the linear one if none was requested and none is better."""
    task = linear.task
    # at least one period, if there is one: a shorter section says nothing about dynamics slower than itself
    period = task.part.informative_samples
    most = max(MOST_COMPARED, period) if period < task.part.longest else MOST_COMPARED
    fewer = liveliest_sections(task.whole, most)
    compared, judged, own = on_fewer_samples(linear.candidates, linear.best, task.part, fewer)
    bend = None
    if structure == "hammerstein" or (structure == "auto" and len(task.data.inputs) == 1):
        bend = _worthwhile_nonlinearity(judged, own, compared, linear.rows, surely=structure == "auto")
        if bend is not None and not linear.related and not bend_explains(bend.fit, compared):
            bend = None
    if structure == "hammerstein":
        if bend is not None:
            return _hammerstein(bend, linear)
        linear.notes.append(IdentificationCode.NO_NONLINEARITY.note(output=task.data.output))
        return linear.identified()
    polynomial = _chosen_polynomial(structure, linear, compared, judged, own, bend)
    stands_in = structure == "auto" and linear.sound
    if bend is not None and (polynomial is None or not polynomial.price < bend.held_back):
        return _hammerstein(bend, linear, _fallback(bend, own, compared, task.whole) if stands_in else None)
    if polynomial is None:
        return linear.identified()
    related = linear.related or polynomial_explains(polynomial, compared)
    fallback = _fallback(polynomial, own, compared, task.whole) if stands_in else None
    return _polynomial(polynomial, linear, fallback, related=related)


def _chosen_polynomial(
    structure: str,
    linear: LinearComparison,
    compared: Channels,
    judged: Sequence[Candidate],
    own: Candidate,
    bend: HammersteinCandidate | None,
) -> PolynomialCandidate | None:
    """Return the best polynomial model, or None if ``auto`` has a linear one that is nearly as good."""
    straight = min([own, *(one for one in judged if not one.doubt)], key=lambda one: one.held_back)
    bar = (1.0 - CLEAR_MARGIN) * straight.held_back if structure == "auto" and linear.sound else float("inf")
    bar = bar if bend is None else min(bar, bend.held_back)
    found = polynomial_candidates([own] if own.doubt else judged, compared, linear.task.asked, bar)
    linear.rows.extend(map(polynomial_row, found))
    better = min(found, key=lambda one: (one.price, one.held_back), default=None)
    if better is None and structure == "narx":
        output = linear.task.data.output
        raise HydrostateError(f"no polynomial model of {output!r} runs free without growing beyond bounds")
    if better is None or structure == "narx" or not linear.sound:
        return better
    return better if better.price < (1.0 - CLEAR_MARGIN) * straight.held_back else None


def _polynomial(
    taken: PolynomialCandidate, linear: LinearComparison, fallback: Fallback | None, *, related: bool
) -> Identified:
    """Return a polynomial model, fitted to all data."""
    data, by = linear.task.data, linear.task.by
    dynamics = replace(_refitted(taken, linear.task.whole), fallback=fallback)
    model = FreeRunModel(data.inputs, data.output, data.sample_time, "narx", by, dynamics)
    found = identified_with_quality(model, linear, taken.held_back)
    if related:
        return found
    return replace(found, notes=(IdentificationCode.UNRELATED.note(output=data.output), *found.notes), sound=False)


def _worthwhile_nonlinearity(
    linear: Sequence[Candidate], best: Candidate, data: Channels, rows: list[dict[str, Any]], *, surely: bool
) -> HammersteinCandidate | None:
    """Return the best model with a nonlinearity at its input, or None if none is better than every linear one."""
    if len(data.inputs) > 1:
        raise HydrostateError(f"structure hammerstein takes one input, got {', '.join(data.inputs)}: use narx")
    found = hammerstein_candidates(linear, data)
    rows += [hammerstein_row(one) for one in found]
    return worthwhile_candidate(found, linear, best, surely=surely)


def _hammerstein(taken: HammersteinCandidate, linear: LinearComparison, fallback: Fallback | None = None) -> Identified:
    """Return a model with a nonlinearity at its input, fitted to all data."""
    data, whole, by = linear.task.data, linear.task.whole, linear.task.by
    part = liveliest_sections(whole, MOST_FITTED)
    # on the data of the comparison, other starts might lead to a model that no block has judged
    compared_whole = liveliest_sections(whole, MOST_COMPARED) is whole
    fit = finished_fit(taken.fit, whole) if compared_whole else refitted_hammerstein(taken.fit, part)
    dynamics = replace(HammersteinDynamics.of(fit, deviations(fit, part)), fallback=fallback)
    model = FreeRunModel(data.inputs, data.output, data.sample_time, "hammerstein", by, dynamics)
    return identified_with_quality(model, linear, taken.held_back)


def _refitted(found: PolynomialCandidate, whole: Channels) -> PolynomialDynamics:
    """Return a polynomial dynamics fitted to all data, or to as much as is practical."""
    return PolynomialDynamics.of(found.refit(liveliest_sections(whole, MOST_FITTED)) or found.fit)


def _fallback(
    taken: PolynomialCandidate | HammersteinCandidate, linear: Candidate, part: Channels, whole: Channels
) -> Fallback:
    """Return the fallback for inputs on which a nonlinear model is not determined."""
    masks = blocks(part, BLOCKS)
    others = tuple(LinearDynamics.of(refitted_linear(linear.fit, part.without(mask))) for mask in masks)
    share = part.n_samples / max(part.n_samples, liveliest_sections(whole, MOST_FITTED).n_samples)
    straight = LinearDynamics.of(refitted_linear(linear.fit, whole))
    if isinstance(taken, PolynomialCandidate):
        return Fallback(straight, others, tuple(map(PolynomialDynamics.of, taken.parts)), linear.held_back, share)
    fits = [refitted_hammerstein(taken.fit, part.without(mask), COARSE) for mask in masks]
    parts = tuple(HammersteinDynamics.of(fit, np.full(fit.values.size, np.nan)) for fit in fits)
    return Fallback(straight, others, parts, linear.held_back, share, taken.held_back)
