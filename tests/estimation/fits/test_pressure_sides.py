"""Gauges of the two chambers with different gains: differential pressure reads more in one direction."""

from dataclasses import replace

import pytest

from estimation.eha.explanation_notes import notes_of
from estimation.notes import RigCode
from tests.estimation.fits.strange_logs import HEALTHY, PRESSURE, explained, log
from tests.thinned import thinned

RUBBING = replace(HEALTHY, friction_quadratic=4.462e6, friction_linear=1.863e4, friction_coulomb=551.0)
"""An actuator with major friction: some 20 bar, of which one percent is far above the noise."""


@pytest.mark.parametrize("half", thinned([0.015, -0.01], [-0.01]))
def test_unlike_gains_of_two_gauges_are_identified_and_bulk_modulus_is_right(half: float) -> None:
    record = log("steps", 2.0, RUBBING)
    true = record[PRESSURE]
    above = record["pressure_a_pa"] + record["pressure_b_pa"] - 2.0 * HEALTHY.accumulator_pressure
    given = record.replace(**{PRESSURE: true + half * above})
    found = explained(given)
    assert found.names == ("pressure_sides",)
    (note,) = notes_of(found, HEALTHY)
    assert note.code is RigCode.PRESSURE_SIDES
    assert note.data["percent"] == pytest.approx(200.0 * half, abs=3.0 * note.data["half_width"])
