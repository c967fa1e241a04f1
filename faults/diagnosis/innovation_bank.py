"""Nine filters on one log, one per condition: the likelihood of their innovations."""

from dataclasses import replace

import numpy as np

from estimation.filters.batch import filter_batch
from estimation.filters.run import filter_problem
from estimation.log_checks.first_belief import first_belief
from estimation.models.eha_forms import PRESSURE_FORM
from faults.eha.bank import mathematical_bank
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.solvers.steps import parameter_row

STEP = 2e-3
"""Longest step of the filters [s]: their implicit step is always stable, and what distinguishes the conditions is
slower."""

SPREAD = 0.3
"""Relative standard deviation of the first guess of bulk modulus [dimensionless]."""

SIDE_BY_SIDE = 16
"""Filters in a kernel: two vectors of eight hold the nine."""


def innovation_scores(record: Record, rig: EhaParameters) -> Array:
    """Return the log-likelihood of a log's innovations under each condition.

    Each filter is the pressure form with the nominal leakage and friction of a condition; bulk modulus is a state. The
    condition is constant within a log, so the filters do not mix (an interacting bank would only limit their
    differences).

    Parameters
    ----------
    record : Record
        The log, with position or velocity.
    rig : EhaParameters
        The healthy actuator.

    Returns
    -------
    ndarray, shape (9,)
        Natural logarithms [dimensionless], in the order of `CONDITIONS`; minus infinity if a filter diverged.
    """
    model = replace(PRESSURE_FORM, longest_step=STEP)
    slow = record.slice(0, None, max(1, round(STEP / record.sample_time)))
    prior = first_belief(model, slow, rig.bulk_modulus, SPREAD * rig.bulk_modulus)
    first, *others = mathematical_bank(rig).values()
    begun = replace(filter_problem(model, prior, slow, first), every=len(slow))  # the track is not used
    if begun.model is model:  # otherwise gaps in the drive give each condition its own model
        problems = [begun, *(replace(begun, parameters=parameter_row(one, model.parameters)) for one in others)]
    else:
        problems = [begun, *(replace(filter_problem(model, prior, slow, one), every=len(slow)) for one in others)]
    found = np.array([trace.log_likelihood for trace in filter_batch(problems, lanes=SIDE_BY_SIDE)])
    return np.where(np.isfinite(found), found, -np.inf)
