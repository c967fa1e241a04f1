"""Linear models of one output, compared on held-back blocks, and the one that may be believed."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.answer_at_once import at_once_note
from estimation.identification.fit.feedback import feedback_note
from estimation.identification.fit.regulated import regulated_note
from estimation.identification.free_run.believable import believable_candidate
from estimation.identification.free_run.candidate_rows import linear_row
from estimation.identification.free_run.choose_linear import Candidate, linear_candidates
from estimation.identification.free_run.data import Channels, Scaling, scaled
from estimation.identification.free_run.dense_polynomial import RequestedSizes
from estimation.identification.free_run.held_back import CLEAR_MARGIN
from estimation.identification.free_run.identified import Identified
from estimation.identification.free_run.integrating import refitted_linear
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_fit import COARSE, fit_linear
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.transfer_function import gain_deviations, linear_model
from estimation.identification.free_run.unrelated import linear_explains
from estimation.identification.notes import CLOSED_LOOP, IdentificationCode
from estimation.log_checks.bridging import bridged
from plant.notes import Note

REVERSE_ORDERS, LARGEST_REVERSE_RATIO, LARGEST_REVERSE_ERROR = (1, 2), 0.5, 0.2
"""Orders of models from output to input, and their largest errors for swapped columns, over the model's error and over
the deviation. In the right direction noise is left; against it, everything that cannot be predicted, and of a
controller's action its set-point."""

LEADS = (1, 2, 3, 4, 5)
"""Samples by which an input may be logged late [count]."""

LEAST_COMPARED_ORDER = 3
"""Orders up to this one at least are compared with a given one before a limit or a random walk is accepted [count]."""


@dataclass(frozen=True, eq=False)
class Task:
    """An identification task.

    Parameters
    ----------
    data : Channels
        In units of the channels.
    whole, by : Channels, Scaling
        The same scaled, and the scaling.
    part : Channels
        The section on which linear models are compared.
    asked : Asked
        Sizes that the user gives.
    orders : list of int
        Orders of linear models that are compared.
    delays : tuple of int or None
        Dead time of each input [samples]; None if the data choose it.
    """

    data: Channels
    whole: Channels
    by: Scaling
    part: Channels
    asked: RequestedSizes
    orders: list[int]
    delays: tuple[int, ...] | None

    @property
    def free(self) -> "Task | None":
        """The task with sizes that the data choose; None if no size was given.

        A given size that is too large or too small may leave errors that look like a limit or a walk.
        """
        orders = list(
            range(1, max(LEAST_COMPARED_ORDER, *self.orders) + 1)
        )  # each order starts from the next lower one
        return (
            None
            if self.asked == RequestedSizes()
            else replace(self, asked=RequestedSizes(), orders=orders, delays=None)
        )


@dataclass(frozen=True, eq=False)
class LinearComparison:
    """Linear models that were compared.

    Parameters
    ----------
    task : Task
        The task.
    candidates : list of Candidate
        All of them.
    best : Candidate
        The one that may be believed.
    related : bool
        Whether the inputs explain the output better than in another order.
    notes : list of Note
        Rejected models, and doubts.
    rows : list of dict
        Compared models, as in `Identified.candidates`; other structures are added.
    """

    task: Task
    candidates: list[Candidate]
    best: Candidate
    related: bool
    notes: list[Note]
    rows: list[dict[str, Any]]

    @property
    def sound(self) -> bool:
        """Whether the best model may be relied on."""
        return self.related and not self.best.doubt

    def identified(self) -> Identified:
        """Return the best model, fitted to all data."""
        data, by, whole, best = self.task.data, self.task.by, self.task.whole, self.best
        fit = refitted_linear(best.fit, whole)
        # a further fit may move a model with a pole at 1 to where it cannot be written: the judged one is then kept
        fit = best.fit if self.task.part is whole and not fit.cost <= best.fit.cost else fit
        alone = len(data.inputs) == 1
        transfer, spread = (
            linear_model(fit, whole, by) if alone else None,
            () if alone else gain_deviations(fit, whole, by),
        )
        named = data.inputs, data.output, data.sample_time, "output-error"
        model = FreeRunModel(*named, by, LinearDynamics.of(fit), transfer)
        quality = model.quality(data.u, data.y)
        known = {note.code for note in self.notes}
        notes = [*self.notes, *(one for one in closed_loop_notes(model, data) if one.code not in known)]
        ahead = (IdentificationCode.SWAPPED, IdentificationCode.INPUT_LOGGED_LATE)
        sound = self.sound and not any(note.code in ahead for note in notes)
        if best.doubt == "no_fit" or not quality.fit_percent > 0.0 or not best.held_back < 1.0:
            notes = [*notes, IdentificationCode.NO_FIT.note(output=data.output, fit=quality.fit_percent)]
            sound = False
        held = 100.0 * (1.0 - best.held_back)
        return Identified(model, quality, held, tuple(self.rows), tuple(notes), sound, gain_std=spread)


def with_closed_loop_notes(found: Identified, linear: LinearComparison) -> Identified:
    """Return a nonlinear model with what the linear one tells of a closed loop; a linear one as it is.

    A nonlinear model may learn the controller's law and its reference in place of the plant, and fit nearly perfectly.

    Parameters
    ----------
    found : Identified
        A model of the same data.
    linear : LinearComparison
        Linear models.
    """
    if found.model.structure == "output-error":
        return found
    told = [note for note in linear.identified().notes if note.code in CLOSED_LOOP]
    return replace(found, notes=(*found.notes, *told))


def linear_comparison(task: Task) -> LinearComparison:
    """Compare linear models of all requested orders."""
    candidates = linear_candidates(task.part, task.orders, task.delays, task.asked.n_numerator)
    best, notes = believable_candidate(candidates, task.part, task.by)
    related = not best.outlasts_block(task.part) or linear_explains(best.fit, task.part)
    said = notes if related else [IdentificationCode.UNRELATED.note(output=task.data.output)]
    said = [*said, *_highest_order_notes(candidates, best, task)]
    return LinearComparison(task, candidates, best, related, said, [linear_row(one) for one in candidates])


def _highest_order_notes(candidates: list[Candidate], best: Candidate, task: Task) -> list[Note]:
    """Return a note if the data chose the highest order that was compared, by a clear margin."""
    order, lower = best.form.order, [one.held_back for one in candidates if one.form.order < best.form.order]
    if order < max(task.orders) or task.asked.order is not None or not lower:
        return []
    less = 1.0 - best.held_back / min(lower)
    if less < CLEAR_MARGIN:
        return []
    told = {"order": order, "less": less, "more": order + 2, "output": task.data.output}
    return [IdentificationCode.HIGHEST_ORDER_TAKEN.note(**told)]


def closed_loop_notes(model: FreeRunModel, data: Channels, *, changes: bool = False) -> list[Note]:
    """Return a note if an input of a linear model follows the output's noise, in the longest log.

    A controller that answers within one sample is named as such, as a noise model without a delay is biased there too.
    So is one whose set-point hardly moves: a model is its inverse then. Of several inputs only this is asked.

    Parameters
    ----------
    model : FreeRunModel
        The model.
    data : Channels
        Levels, in units of the channels.
    changes : bool
        Whether changes from sample to sample are tested, for an output whose noise is a random walk.
    """
    k = int(np.argmax([y.size for y in data.y]))
    u, y = data.u[k], data.y[k]
    asked = (regulated_note(u[:, place], y, (name, data.output)) for place, name in enumerate(data.inputs))
    regulated = next((note for note in asked if note is not None), None)
    if len(data.inputs) != 1:
        return [] if regulated is None else [regulated]
    left, followed = y - model.simulate(u, y), u[:, 0]
    if changes:
        left, followed = np.diff(left), np.diff(followed)
    said = feedback_note(left, followed, (data.inputs[0], data.output))
    if model.linear is not None:
        said = at_once_note(model.linear, u[:, 0], y) or said
    if said is None and regulated is None:
        return []
    ahead = None if changes else swapped_channels_note(left, data, k)
    both = (said or regulated,) if ahead is None else (ahead, regulated)
    return [one for one in both if one is not None]


def swapped_channels_note(left: Array, data: Channels, log: int) -> Note | None:
    """Return a note if the input responds to the output instead of the other way round, or is logged late.

    A model of the wrong direction looks ahead, and so does one with a late input: the one with the smaller error is
    reported. A late input is also reported if the other direction has a large error, as behind noise.

    Parameters
    ----------
    left : ndarray, shape (n,)
        Residual of the model for the output of one log [output unit].
    data : Channels
        In units of the channels.
    log : int
        Which log.
    """
    u, y = data.u[log][:, 0], data.y[log]
    back = _small_model_error(Channels((data.output,), data.inputs[0], data.sample_time, (bridged(y)[:, None],), (u,)))
    own = float(np.sqrt(np.nanmean(left**2)) / np.nanstd(y))
    moved = [replace(data, u=(data.u[log][lead:],), y=(y[:-lead],)) for lead in LEADS]
    ahead, lead = min((_small_model_error(one), lead) for one, lead in zip(moved, LEADS, strict=True))
    names = {"input": data.inputs[0], "output": data.output}
    against = back < min(LARGEST_REVERSE_RATIO * own, LARGEST_REVERSE_ERROR)
    if ahead <= back and (against or ahead < LARGEST_REVERSE_RATIO * min(own, LARGEST_REVERSE_ERROR)):
        return IdentificationCode.INPUT_LOGGED_LATE.note(**names, samples=lead, ahead=ahead, left=own)
    return IdentificationCode.SWAPPED.note(**names, back=back, left=own) if against else None


def _small_model_error(data: Channels) -> float:
    """Return the error of a small linear model without dead time, over the output's deviation [dimensionless]."""
    whole, _ = scaled(data)
    fits = (fit_linear(Form(order, (order + 1,), (0,)), whole, least_gain=COARSE) for order in REVERSE_ORDERS)
    return float(np.sqrt(min(fit.cost for fit in fits) / whole.n_samples))
