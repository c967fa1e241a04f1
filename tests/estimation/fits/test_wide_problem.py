"""Where the searches for what is strange about a log begin."""

import numpy as np
import pytest

from estimation.fits.greybox_log import greybox_log
from estimation.fits.hypotheses import HYPOTHESES, Hypothesis
from estimation.fits.wide_problem import freed, own_starts, widened
from estimation.models.flow import FLOW_FORM
from estimation.models.flow_parameters import flow_parameters
from plant.eha.model import EhaParameters
from plant.log.record import Record

RIG = EhaParameters()
VARIANCES = {"differential_pressure_pa": 1e6}


@pytest.mark.parametrize("one", HYPOTHESES, ids=[one.name for one in HYPOTHESES])
def test_every_search_of_a_log_with_a_dead_pressure_sensor_begins_at_a_number(one: Hypothesis) -> None:
    still = dict.fromkeys((*FLOW_FORM.drives, *FLOW_FORM.outputs), np.zeros(20))
    log = widened(
        greybox_log(FLOW_FORM, Record(1e-3, still), flow_parameters(RIG), longest_step=1e-3, variances=VARIANCES), RIG
    )
    model = freed(log, (one,)).model
    known = dict.fromkeys(model.unknowns, 1.0)
    for start in own_starts(log, one):
        assert np.all(np.isfinite(model.theta({**known, **start})))
