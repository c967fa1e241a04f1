"""A make-up valve that never opened in a log is reported, and so is pump wear that a log does not exclude."""

import math
from dataclasses import replace

import numpy as np
import pytest

from estimation.eha.rig_share import undetermined_delivery
from estimation.fits.hypothesis_search.not_excluded import OPEN_DELIVERY, open_wear_note, share_lost, unseen_valve_note
from estimation.fits.hypothesis_search.predicted_gains import NO_GAIN, PredictedGain
from estimation.notes import RigCode
from tests.estimation.fits.short_logs import PAPER, log, made_fit, seen

FELT, UNFELT = 900.0, np.inf


@pytest.mark.parametrize(
    ("stds", "sides"),
    [
        ({"crack_a": FELT, "crack_b": UNFELT}, ["B"]),
        ({"crack_a": UNFELT, "crack_b": FELT}, ["A"]),
        ({"crack_a": FELT, "crack_b": FELT}, []),
        ({"crack_a": UNFELT, "crack_b": UNFELT}, []),  # an actuator without make-up, or a log that needs none
        ({}, []),
    ],
)
def test_a_make_up_valve_without_effect_is_reported_only_if_the_other_has_one(
    stds: dict[str, float], sides: list[str]
) -> None:
    fit = made_fit(100.0, 2e8, 1e5)
    said = unseen_valve_note(replace(fit, std={**fit.std, **stds}))
    assert [note.data["side"] for note in said] == sides
    assert all(note.code is RigCode.MAKEUP_UNSEEN for note in said)


@pytest.mark.parametrize(
    ("size", "deviation", "percent"),
    [
        (0.0, 0.5 * OPEN_DELIVERY, None),
        (0.0, 0.15, 30.0),
        (-0.08, 0.02, 12.0),  # known well, but well below a sound pump
        (0.08, 0.08, None),  # as far above a sound pump
        (-0.05, 0.02, 9.0),
        (-0.05, 0.024, 9.8),  # two deviations below
        (-0.04, 0.025, None),
        (-0.029, 0.001, None),
    ],
)
def test_wear_is_possible_if_two_deviations_below_the_estimate_reach_the_limit(
    size: float, deviation: float, percent: float | None
) -> None:
    said = open_wear_note(PredictedGain(1.0, size, deviation))
    assert [note.data["percent"] for note in said] == ([] if percent is None else [pytest.approx(percent)])
    assert open_wear_note(NO_GAIN) == ()


def test_wear_explains_no_more_flow_than_the_losses_of_the_fit() -> None:
    """By slopes the pump of three sound logs was worn with 53 to 97 %: it would have had to leak backwards."""
    plain = seen(log(0.2))
    plain = replace(plain, drives=np.full_like(plain.drives, 100.0), measured=np.full_like(plain.measured, -5e5))
    values = {"flow_bias": 2.36e-6, "leakage_coefficient": 4.78e-12}
    most = share_lost(plain, values, PAPER.pump_displacement)
    assert most == pytest.approx(-math.log(1.0 - 0.0853), rel=2e-3)
    assert share_lost(plain, values, PAPER.pump_displacement, ["air"]) == most
    assert share_lost(plain, values, PAPER.pump_displacement, ["air", "leakage_step"]) == math.inf
    assert share_lost(plain, {}, PAPER.pump_displacement) == math.inf
    slopes = PredictedGain(1.0, -0.12, 0.12)
    assert open_wear_note(slopes, most) == ()
    (noted,) = open_wear_note(slopes, 0.2)
    assert noted.data["percent"] == pytest.approx(20.0)
    assert undetermined_delivery((noted,)) == (pytest.approx(-0.12), pytest.approx(0.12), pytest.approx(-0.2))
    assert undetermined_delivery(open_wear_note(slopes, 0.5)) == undetermined_delivery(open_wear_note(slopes))
