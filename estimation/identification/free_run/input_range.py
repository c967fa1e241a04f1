"""Whether a polynomial model is asked about inputs that it never saw: there its products say nothing."""

import numpy as np

from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.free_run.polynomial_variables import BEYOND
from estimation.identification.notes import IdentificationCode
from plant.notes import Note


def inputs_beyond(model: FreeRunModel, data: Channels) -> list[Note]:
    """Return a note on each input that leaves the range in which a polynomial model was fitted.

    Parameters
    ----------
    model : FreeRunModel
        Models of other structures have no such range.
    data : Channels
        In units of the channels; inputs in the model's order.

    Returns
    -------
    list of Note
        One an input that leaves its range by a tenth of it or more, with how far and how often.
    """
    if not isinstance(model.dynamics, PolynomialDynamics):
        return []
    variables, by, notes = model.dynamics.variables, model.scaling, list[Note]()
    together = np.concatenate(data.u)
    for index, name in enumerate(data.inputs):
        own = variables.limits[variables.source == index + 1]
        if own.size == 0:
            continue
        values = (together[:, index] - by.u_mean[index]) / by.u_std[index]
        outside = (values < own[0, 0]) | (values > own[0, 1])
        if not outside.any():
            continue
        margin = BEYOND * (own[0, 1] - own[0, 0]) / (1.0 + 2.0 * BEYOND)
        low, high = by.u_mean[index] + by.u_std[index] * (own[0] + margin * np.array([1.0, -1.0]))
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
