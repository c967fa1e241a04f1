"""Lumped leakage: the sum of two leaks, for a log that shows neither of them alone."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.flow.losses import UNEVEN_SIDES, losses, with_lumped, with_lumped_slopes
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.hypothesis_search.form_fit import DISCRETISED
from estimation.models.flow import FLOW_FORM
from plant.arrays import Array
from plant.eha.model import EhaParameters

LEAKAGE, DRAIN, BIAS = "leakage_coefficient", "case_leakage", "flow_bias"
PAPER = EhaParameters()
ACROSS, DRAINED, BIASED = 5e-12, 4e-13, 2e-6


def fit(across: float = ACROSS, apart: float = -0.99) -> GreyBoxFit:
    """Return the fit of a log that shows only the sum of two leaks: the drain is known to 50 %, the leakage to 2 %."""
    unknowns = FLOW_FORM.unknowns
    values = {**dict.fromkeys(unknowns, 1.0), LEAKAGE: across, DRAIN: DRAINED, BIAS: BIASED}
    deviations = {LEAKAGE: 0.02, DRAIN: 0.5, BIAS: 0.01}
    covariance = np.diag([deviations.get(name, 1.0) ** 2 for name in unknowns])
    first, second = unknowns.index(LEAKAGE), unknowns.index(DRAIN)
    covariance[first, second] = covariance[second, first] = apart * 0.02 * 0.5
    std = {name: values[name] * deviations.get(name, 1.0) for name in unknowns}
    return GreyBoxFit(FLOW_FORM, np.zeros(len(unknowns)), values, std, 0.0, (1.0,), (0.0,), covariance=covariance)


def found(one: GreyBoxFit) -> dict[str, tuple[float, float]]:
    return {name: (value, one.std[name]) for name, value in one.values.items()}


def weights(*each: float) -> Array:
    return np.array(each)


def test_lumped_leakage_is_known_even_if_neither_of_its_two_leaks_is() -> None:
    told, _ = with_lumped(found(fit()), [fit()], weights(1.0), PAPER)
    value, std = told[LEAKAGE]
    assert value == pytest.approx(ACROSS + 0.5 * DRAINED, rel=1e-9, abs=0.0)
    assert std == pytest.approx(ACROSS * 0.02 * (2.0 * (1.0 - 0.99)) ** 0.5, rel=0.01, abs=0.0)
    assert told[BIAS] == found(fit())[BIAS]


def test_leakage_is_known_no_better_than_the_discretisation_error_of_the_flow_balance() -> None:
    """Leakage of a circuit at 10 kHz was reported to within 0.005 %, and was 0.02 % off."""
    sure = replace(fit(), covariance=1e-12 * fit().covariance)
    told, correlation = with_lumped(found(sure), [sure], weights(1.0), PAPER)
    steps = DISCRETISED * PAPER.pump_displacement * PAPER.rated_speed / PAPER.relief_pressure
    assert told[LEAKAGE][1] == pytest.approx(steps, rel=1e-3, abs=0.0)
    assert abs(correlation) < 0.01


def test_losses_of_a_single_rod_are_known_no_better_than_its_balance_and_its_drain() -> None:
    """Leakage of four single rods was 7 to 110 deviations off: a drain of the other side looks like a leak."""
    sure, single = replace(fit(), covariance=1e-12 * fit().covariance), replace(PAPER, area_difference=0.2)
    told, _ = with_lumped(found(sure), [sure], weights(1.0), single, 1e6)
    left_out = UNEVEN_SIDES * PAPER.rated_flow
    assert told[LEAKAGE][1] == pytest.approx(np.hypot(left_out / 1e6, 0.5 * DRAINED), rel=1e-3, abs=0.0)
    assert told[BIAS][1] == pytest.approx(np.hypot(found(sure)[BIAS][1], left_out), rel=1e-3)


def test_disagreement_between_fits_widens_the_deviation_of_leakage() -> None:
    apart = [fit(), fit(1.1 * ACROSS)]
    value, covariance = losses(apart, weights(0.5, 0.5))
    assert value[0] == pytest.approx(1.05 * ACROSS + 0.5 * DRAINED, rel=1e-9, abs=0.0)
    assert covariance[0, 0] ** 0.5 > 0.05 * ACROSS
    assert losses(apart, weights(1.0, 1e-30))[0][0] == pytest.approx(ACROSS + 0.5 * DRAINED, rel=1e-9, abs=0.0)


def test_an_undetermined_leak_makes_the_lumped_leakage_undetermined() -> None:
    unfelt = replace(fit(), std={**fit().std, LEAKAGE: np.inf})
    told, correlation = with_lumped(found(unfelt), [unfelt], weights(1.0), PAPER)
    assert told[LEAKAGE] == (ACROSS + 0.5 * DRAINED, np.inf)
    assert correlation == 0.0


def test_a_leakage_that_changed_is_reported_at_its_final_value() -> None:
    ended = {**found(fit()), LEAKAGE: (3.0 * ACROSS, 3.0 * fit().std[LEAKAGE])}
    (told, _), (once, _) = (with_lumped(one, [fit()], weights(1.0), PAPER) for one in (ended, found(fit())))
    assert told[LEAKAGE] == pytest.approx(tuple(3.0 * each for each in once[LEAKAGE]), rel=1e-9, abs=0.0)


def test_the_rig_slope_of_lumped_leakage_combines_those_of_both_leaks() -> None:
    told = with_lumped_slopes({"piston_area": {LEAKAGE: 2.0, DRAIN: 4.0, BIAS: 1.0}})
    assert told == {"piston_area": {LEAKAGE: 4.0, DRAIN: 4.0, BIAS: 1.0}}
