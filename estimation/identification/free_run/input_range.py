"""Whether a polynomial model is run on inputs outside its training range, and whether a linear one replaces it."""

from collections.abc import Sequence
from itertools import count

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.fallback import linear_stands_in
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.free_run.polynomial_variables import SIGNAL_MARGIN
from estimation.identification.free_run.quality import FreeRun
from estimation.identification.notes import IdentificationCode
from plant.notes import Note


def input_range_notes(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return a note on each input that leaves the range in which a polynomial or an error model was fitted.

    Parameters
    ----------
    model : FreeRunModel
        Models of other structures have no such range.
    data : Channels
        In units of the channels; inputs in the model's order.

    Returns
    -------
    list of Note
        One per input that leaves its range by a tenth of it or more, with how far and how often.
    """
    by, notes, together = model.scaling, list[Note](), np.concatenate(data.u)
    for index, name in enumerate(data.inputs):
        ends = _ends_of_input(model, index)
        values = (together[:, index] - by.u_mean[index]) / by.u_std[index]
        if ends is None or not (outside := (values < ends[0]) | (values > ends[1])).any():
            continue
        margin = SIGNAL_MARGIN * (ends[1] - ends[0]) / (1.0 + 2.0 * SIGNAL_MARGIN)
        low, high = by.u_mean[index] + by.u_std[index] * (ends + margin * np.array([1.0, -1.0]))
        notes.append(
            IdentificationCode.INPUT_BEYOND_RANGE.note(
                channel=name,
                share=float(outside.mean()),
                least=float(together[:, index].min()),
                greatest=float(together[:, index].max()),
                low=float(low),
                high=float(high),
            )
        )
    return notes


def _ends_of_input(model: FreeRunModel, index: int) -> Array | None:
    """Return the ends, scaled, at which an input counts in a polynomial, shape (2,); None if it is in none."""
    if isinstance(model.dynamics, PolynomialDynamics):
        variables = model.dynamics.variables
        own = variables.limits[variables.source == index + 1]
        if own.size:
            return own[0]
    return None if model.error_model is None else model.error_model.ends[:, index + 1]


def linear_fallback_notes(model: FreeRunModel, runs: Sequence[FreeRun], output: str) -> list[Note]:
    """Return a note if a linear model replaces a nonlinear one that the inputs of some runs do not determine.

    Parameters
    ----------
    output : str
        Name of the output for the reader.

    Returns
    -------
    list of Note
        One at most, for the log on which the nonlinear model is determined least.
    """
    judged = [run.errors for run in runs if run.errors is not None]
    undetermined, linear = max([(0.0, 1.0), *judged], key=lambda pair: pair[0] / pair[1])
    if not linear_stands_in((undetermined, linear)):
        return []
    return [
        IdentificationCode.LINEAR_STANDS_IN.note(
            output=output, structure=model.structure, undetermined=undetermined, linear=linear
        )
    ]


def doubts_about_inputs(
    model: FreeRunModel, data: Channels, runs: Sequence[FreeRun], named: str = "the log"
) -> list[Note]:
    """Return the notes on a run with these inputs.

    Parameters
    ----------
    model : FreeRunModel
        Any.
    data : Channels
        In units of the channels; inputs in the model's order.
    runs : sequence of FreeRun
        The model's run of each log.
    named : str
        Name of the logs for the reader.

    Returns
    -------
    list of Note
        That no log is longer than the dead time, or that a linear model replaces the nonlinear one; otherwise one on
        each input beyond its range, and that the error model is left out.
    """
    if all(model.dynamics.undetermined_outputs(y.size) == y.size for y in data.y):
        dead_time = next(n for n in count(data.longest) if model.dynamics.undetermined_outputs(n + 1) == n)
        told = {"logs": named, "output": data.output, "longest": data.longest, "dead_time": dead_time}
        return [IdentificationCode.NOTHING_ANSWERED.note(**told)]
    if replaced := linear_fallback_notes(model, runs, data.output):
        return replaced
    notes = input_range_notes(model, data)
    if any(run.without_error_model for run in runs):
        notes.append(IdentificationCode.ERROR_MODEL_LEFT_OUT.note(output=data.output, structure=model.structure))
    return notes
