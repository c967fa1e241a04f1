"""From channels of several outputs to their models: one state-space model, or one model for each output."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from estimation.identification.free_run.choose_linear import CLEAR_GAIN
from estimation.identification.free_run.data import Channels, liveliest_sections, require_room, require_size, scaled
from estimation.identification.free_run.doubtful_channels import doubtful_channels
from estimation.identification.free_run.held_back import pooled_error
from estimation.identification.free_run.identify import (
    FREE_STRUCTURES,
    HIGHEST_ORDER,
    MOST_CHOSEN,
    MOST_FITTED,
    Identified,
    identify_channels,
)
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.random_walk import walk_followed_notes
from estimation.identification.notes import RAISED_AS_WARNINGS, IdentificationCode
from estimation.identification.state_space.choose import StateCandidate, chosen_state, state_candidates
from estimation.identification.state_space.dynamics import StateSpaceDynamics
from estimation.identification.state_space.fit import fit_state_space, system_of
from estimation.identification.state_space.joint import joined_outputs
from plant.errors import HydrostateError, LogWarning, require_known
from plant.notes import Note

STATE_SPACE = "state-space"
"""What the structure is called."""

MOST_STATES = 8
"""States at most, where the data choose."""


def identify_outputs(
    data: Sequence[Channels],
    *,
    structure: str = "output-error",
    order: int | None = None,
    delay: int | None = None,
    n_numerator: int | None = None,
) -> list[Identified]:
    """Identify the relation from inputs to each output.

    Parameters
    ----------
    data : sequence of Channels
        One an output, inputs alike.
    structure : str
        ``"state-space"``: one model of all outputs, with its covariance. ``"auto"``: that one, where it leaves less on
        blocks held back than a model an output, by a margin where it needs more values. Any other as
        `identify_channels` takes it, one model an output.
    order, delay, n_numerator : int, optional
        As `identify_channels` takes them; of a state space the order is the number of states.

    Raises
    ------
    HydrostateError
        As `identify_channels`; if a state space is wanted with a size of the numerator.

    Warns
    -----
    LogWarning
        As `identify_channels`.
    """
    require_known("structure", structure, (*FREE_STRUCTURES, STATE_SPACE))
    form: dict[str, Any] = {"order": order, "delay": delay}
    if structure == STATE_SPACE:
        if n_numerator is not None:
            raise HydrostateError(f"a state space has no numerator of its own, got {n_numerator} coefficients")
        return identify_state_space(data, **form)
    single = [identify_channels(one, structure=structure, n_numerator=n_numerator, **form) for one in data]
    if structure != "auto" or len(data) == 1 or n_numerator is not None:
        return single
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", LogWarning)
            together = _fitted_to_levels(data, order, delay)  # random walks have been tested for already
    except HydrostateError:
        # too few samples for so many values: one model for each output needs fewer
        return single
    rows = [(*one.candidates, *other.candidates) for one, other in zip(single, together, strict=True)]
    fewer = together[0].model.n_values < sum(one.model.n_values for one in single)
    bar = _pooled_error(single) * (1.0 if fewer else 1.0 - CLEAR_GAIN)
    # with slow poles a state space would follow outputs that wander by themselves or differ from log to log
    alone = (IdentificationCode.UNRELATED, IdentificationCode.RANDOM_WALK, IdentificationCode.OFFSETS_DIFFER)
    related = not any(note.code in alone for one in single for note in one.notes)
    better = related and all(one.sound for one in together) and _pooled_error(together) < bar
    return [replace(one, candidates=row) for one, row in zip(together if better else single, rows, strict=True)]


def _pooled_error(found: Sequence[Identified]) -> float:
    """Return the held-back error of all outputs, each divided by its standard deviation."""
    return pooled_error([1.0 - one.held_back_percent / 100.0 for one in found])


def identify_state_space(
    data: Sequence[Channels], *, order: int | None = None, delay: int | None = None
) -> list[Identified]:
    """Identify one state-space model from all inputs to all outputs, with levels, initial states and covariance.

    It starts at a subspace estimate, and maximises the likelihood for white output noise of unknown covariance.

    Parameters
    ----------
    data : sequence of Channels
        One an output, inputs alike.
    order : int, optional
        States; chosen by the free run on blocks held back where not given.
    delay : int, optional
        Dead time of every input [samples]; likewise.

    Returns
    -------
    list of Identified
        One an output; the models share their states.

    Raises
    ------
    HydrostateError
        If the logs are too short for the order, or inputs differ between outputs.

    Warns
    -----
    LogWarning
        If the model is not to be believed.
    """
    found = _fitted_to_levels(data, order, delay)
    found = [
        replace(one, notes=(*one.notes, *notes), sound=one.sound and not notes)
        for one, notes in zip(found, map(_walk_notes, data), strict=True)
    ]
    for note in {note.code: note for one in found for note in one.notes if note.code in RAISED_AS_WARNINGS}.values():
        warnings.warn(LogWarning(note), stacklevel=2)
    return found


def _fitted_to_levels(data: Sequence[Channels], order: int | None, delay: int | None) -> list[Identified]:
    """Return the state-space model of a size for which the logs are long enough."""
    require_size(order, delay, None)
    for one in data:
        require_room(one, None, delay, None)  # the fit itself checks the length for the order
    with threadpool_limits(limits=1, user_api="blas"):
        return _identified_outputs(data, range(1, MOST_STATES + 1) if order is None else [order], delay)


def _walk_notes(data: Channels) -> list[Note]:
    """Return a note if an output drifts by itself."""
    whole, _ = scaled(data)
    return walk_followed_notes(whole, liveliest_sections(whole, MOST_CHOSEN), range(1, HIGHEST_ORDER + 1), STATE_SPACE)


def _identified_outputs(data: Sequence[Channels], orders: Sequence[int], delay: int | None) -> list[Identified]:
    both = [scaled(one) for one in data]
    whole = [liveliest_sections(one, MOST_FITTED) for one, _ in both]
    candidates = state_candidates([liveliest_sections(one, MOST_CHOSEN) for one, _ in both], orders, delay)
    best = chosen_state(candidates)
    together = joined_outputs(whole).delayed(best.delays)
    start = best.fit.theta if together.n_samples <= MOST_CHOSEN else None
    system = system_of(fit_state_space(best.fit.size, together, start), together, best.delays)
    rows = tuple(one.row() for one in candidates)
    found: list[Identified] = []
    for place, (one, (_, by)) in enumerate(zip(data, both, strict=True)):
        dynamics = StateSpaceDynamics(system, place)
        model = FreeRunModel(one.inputs, one.output, one.sample_time, STATE_SPACE, by, dynamics)
        found.append(_judged_output(model, one, best, best.held_back[place], rows))
    return found


def _judged_output(
    model: FreeRunModel, data: Channels, best: StateCandidate, held_back: float, rows: tuple[dict[str, Any], ...]
) -> Identified:
    quality, notes = model.quality(data.u, data.y), []
    if best.doubt:
        radius = float(np.abs(np.linalg.eigvals(best.fit.a)).max())
        slowest = -data.sample_time / float(np.log(radius)) if radius < 1.0 else float("inf")
        notes.append(
            IdentificationCode.TIME_CONSTANT_BEYOND_RECORD.note(
                order=best.fit.size.n, time_constant_s=slowest, duration_s=data.duration
            )
        )
    if not quality.fit_percent > 0.0 or not held_back < 1.0:
        notes.append(IdentificationCode.NO_FIT.note(output=data.output, fit=quality.fit_percent))
    doubtful = doubtful_channels(model, data)
    return Identified(model, quality, 100.0 * (1.0 - held_back), rows, (*notes, *doubtful), not notes)
