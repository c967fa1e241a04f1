"""Which linear model may be believed: one that integrates, a slow one, or a faster or simpler one instead."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.identification.free_run.choose_linear import INTEGRATING, Candidate, chosen_linear, slowest_pole
from estimation.identification.free_run.data import Channels, Scaling
from estimation.identification.free_run.excited_band import band_end, rings_above_band
from estimation.identification.free_run.held_back import halves_error, surely_better
from estimation.identification.free_run.transfer_function import linear_model
from estimation.identification.notes import IdentificationCode
from plant.notes import Note

NEARLY_AS_GOOD = 0.02
"""Relative increase of the held-back error that is accepted for a model without cancelling or undetermined parts."""

LARGEST_ERROR_BELIEVED = 0.5
"""The same, over the output's deviation, if no other model is possible."""


def believable_candidate(candidates: Sequence[Candidate], data: Channels, by: Scaling) -> tuple[Candidate, list[Note]]:
    """Return the candidate that may be believed, and notes on those that were rejected for it.

    Parameters
    ----------
    candidates : sequence of Candidate
        At least one.
    data, by : Channels, Scaling
        Scaled, and the scaling.
    """
    best, notes = _with_believable_delay(candidates, data, by)
    end = band_end(data)
    within = [one for one in candidates if not rings_above_band(one, data, end)]
    if within and rings_above_band(best, data, end):
        # the blocks do not excite that range either, so a model that rings there must be better within the band
        other, said = _with_believable_delay(within, data, by)
        pays = other.price > (1.0 + NEARLY_AS_GOOD) * best.price
        if not (other.doubt or (pays and surely_better(best.block_errors, other.block_errors))):
            return other, said
    return best, notes


def _with_believable_delay(
    candidates: Sequence[Candidate], data: Channels, by: Scaling
) -> tuple[Candidate, list[Note]]:
    """Return the best model whose dead time and sizes are believed, whether or not it rings above the inputs' band."""
    best, notes = _with_believable_size(candidates, data, by)
    prompt = [one for one in candidates if max(one.form.delays) <= 1]
    if max(best.form.delays) > 1 and prompt:
        # the dead time was selected among many, with second-order models, so it must win by more than chance
        other, said = _with_believable_size(prompt, data, by)
        slower = other.outlasts_block(data) and not best.outlasts_block(data)
        if not (other.doubt or slower or surely_better(best.block_errors, other.block_errors)):
            return other, said
    return best, notes


def _with_believable_size(candidates: Sequence[Candidate], data: Channels, by: Scaling) -> tuple[Candidate, list[Note]]:
    """Return the best model whose sizes are believed; its dead time counts as one of them."""
    notes: list[Note] = []
    best = chosen_linear(candidates)
    # a time constant bounded by the record's length acts nearly like an integrator, so it is no alternative to one
    free = [one for one in candidates if not (one.fit.bounded or one.fit.integrates)]
    other = chosen_linear(free or candidates)
    bar = LARGEST_ERROR_BELIEVED if other.doubt else INTEGRATING * other.held_back
    beyond = [one for one in free if one.doubt == "time_constant"]
    # if two poles are close to 1, no model with one pole at 1 can be written
    alone = {one.form for one in beyond} - {one.form for one in candidates if one.fit.integrates}
    integrating = [one for one in candidates if one.fit.integrates and one.doubt != "no_fit"]
    integrating += [one for one in beyond if one.form in alone]
    tempting = chosen_linear(integrating) if integrating else None
    settled = [one for one in free if not one.doubt]
    if tempting is not None and tempting.held_back < bar and not _is_needless_integrator(tempting, settled):
        return replace(tempting, doubt=""), [_slow_note(tempting, data)]
    if best.doubt == "time_constant":
        told = {
            "time_constant_s": _time_constant(best, data),
            "duration_s": data.informative_samples * data.sample_time,
        }
        notes.append(IdentificationCode.TIME_CONSTANT_BEYOND_RECORD.note(order=best.form.order, **told))
        return best, notes
    passed = [one for one in candidates if one.doubt == "time_constant" and one.held_back < best.held_back]
    if passed:
        notes.append(
            IdentificationCode.SLOW_MODELS_PASSED_OVER.note(
                count=len(passed), duration_s=data.informative_samples * data.sample_time
            )
        )
    beyond = list(notes)
    simpler = [
        one for one in candidates if not one.doubt and one is not best and one.form.n_values <= best.form.n_values
    ]
    near = [one for one in simpler if one.price <= (1.0 + NEARLY_AS_GOOD) * best.price]
    if near and len(data.inputs) == 1 and _is_undetermined(best, data, by):
        clean = [one for one in near if not _is_undetermined(one, data, by)]
        if clean:
            taken = min(clean, key=lambda one: one.price)
            notes.append(IdentificationCode.SIMPLER_MODEL_TAKEN.note(order=best.form.order, taken=taken.form.order))
            best = taken
    # outputs on both sides of a block tie a slower pole to this record's drift: the slow model must win by more than
    # chance, and halves of the record, which are not tied in this way, count too
    quick = [one for one in candidates if not (one.doubt or one.outlasts_block(data))]
    if quick and best.outlasts_block(data):
        taken, said = _with_believable_size(quick, data, by)
        if not (surely_better(best.block_errors, taken.block_errors) and _is_slow_as_good(best, taken, data)):
            return taken, [*beyond, *said]
    return best, notes


def _is_needless_integrator(integrating: Candidate, settled: Sequence[Candidate]) -> bool:
    """Return whether a stable model with no more values explains the whole record better than an integrating one.

    If a block contains the only step of the inputs, the fit to the others does not show how the output settles.
    """
    smaller = [one for one in settled if one.form.n_values <= integrating.form.n_values]
    return any(one.bic < integrating.bic for one in smaller)


def _time_constant(one: Candidate, data: Channels) -> float:
    """Return the longest time constant [s]."""
    radius = slowest_pole(one.fit.f)
    return -data.sample_time / float(np.log(radius)) if radius < 1.0 else float("inf")


def _slow_note(taken: Candidate, data: Channels) -> Note:
    """Return the note on a model that integrates, or is slower than the period of its inputs."""
    slowest = _time_constant(taken, data)
    if taken.fit.integrates or slowest > data.duration:
        return IdentificationCode.INTEGRATES.note(output=data.output)
    return IdentificationCode.SLOWER_THAN_PERIOD.note(
        output=data.output, time_constant_s=slowest, duration_s=data.informative_samples * data.sample_time
    )


def _is_slow_as_good(slow: Candidate, quick: Candidate, data: Channels) -> bool:
    """Return whether a slow model has no larger error on blocks and halves than a fast one."""
    errors = [np.hypot(one.held_back, halves_error(one.fit, data)) for one in (slow, quick)]
    return not errors[0] > errors[1]


def _is_undetermined(one: Candidate, data: Channels, by: Scaling) -> bool:
    """Return whether a pole and a zero cancel, or the steady gain is smaller than its standard deviation."""
    model = linear_model(one.fit, data, by)
    return bool(model.cancellations) or not model.dc_gain_std < abs(model.dc_gain)
