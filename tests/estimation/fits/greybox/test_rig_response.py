"""A fit answers a wrong rig file as the laws of scale of the flow balance say."""

import numpy as np
import pytest

from estimation.fits.greybox.deviations import information
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.rig_response import responses_to_rig
from estimation.models.flow import FLOW_FORM
from tests.estimation.fits.short_logs import log, seen, usual

FITTED = ("bulk_modulus", "leakage_coefficient", "flow_bias")


def test_bulk_modulus_scales_with_the_volume_and_losses_with_a_common_scale_of_flows_and_volumes() -> None:
    wrong = dict.fromkeys(("chamber_volume", "pump_displacement", "piston_area"), 0.1)
    one = FreedProblem.of(FLOW_FORM, seen(log(0.5), **wrong))
    theta = usual(one)
    errors, slopes = one.linearised(theta)
    felt = np.flatnonzero(np.any(slopes != 0.0, axis=0))
    known_of = information(one, theta, errors, slopes, felt, warned=False)
    answers = dict(responses_to_rig(one, theta, known_of))
    places = [one.model.unknowns.index(name) for name in FITTED]  # each is fitted as a logarithm
    assert answers["chamber_volume"][places] == pytest.approx([1.0, 0.0, 0.0], abs=0.01)
    assert sum(answers.values())[places] == pytest.approx([0.0, 1.0, 1.0], abs=0.03)
