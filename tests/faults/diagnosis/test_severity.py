"""Severities in the units of a shop."""

import numpy as np
import pytest

from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuit_runs import coordinates_of
from faults.diagnosis.class_fit import Actuator
from faults.diagnosis.severity import UNITS, severities_at
from faults.eha.inject import with_bulk_modulus
from plant.components.oil import effective_bulk_modulus
from plant.eha.model import EhaParameters
from plant.eha.steady_state import steady_state

RIG = EhaParameters()
ACTUATOR = Actuator.of(RIG)


def severities_of(p: EhaParameters) -> dict[str, float]:
    return dict(severities_at(coordinates_of(p, ACTUATOR.rated), ACTUATOR))


def test_a_healthy_actuator_has_lost_nothing() -> None:
    found = severities_of(RIG)
    assert list(found) == list(UNITS)
    for name in ("velocity_lost", "added_friction", "pressure_rise", "entrained_air"):
        assert found[name] == pytest.approx(0.0, abs=1e-6)
    assert found["leakage_flow"] == pytest.approx(6e4 * (4.784e-12 * 3.4475e6 + 2.413e-6))
    assert found["bulk_modulus"] == pytest.approx(2.07e8)


@pytest.mark.parametrize("name", CONDITIONS)
def test_velocity_lost_and_pressure_rise_are_those_of_the_steady_state(name: str) -> None:
    found = severities_of(parameters_for(CONDITIONS[name]))
    (velocity, pressure), (sound, low) = (
        steady_state(RIG.rated_speed, p) for p in (parameters_for(CONDITIONS[name]), RIG)
    )
    assert found["velocity_lost"] == pytest.approx(100.0 * (1.0 - velocity / sound), abs=1e-6)
    assert found["pressure_rise"] == pytest.approx(100.0 * (pressure / low - 1.0), abs=1e-6)


def test_air_is_what_would_make_the_oil_so_soft() -> None:
    share = 0.01
    soft = float(effective_bulk_modulus(RIG.accumulator_pressure, RIG.bulk_modulus, share, 0.0))
    assert severities_of(with_bulk_modulus(RIG, soft))["entrained_air"] == pytest.approx(100.0 * share, rel=0.05)


def test_severities_rise_with_their_fault() -> None:
    leaking = [
        severities_of(parameters_for(CONDITIONS[n]))["leakage_flow"]
        for n in ("normal", "minor_leakage", "major_leakage")
    ]
    rubbing = [
        severities_of(parameters_for(CONDITIONS[n]))["added_friction"]
        for n in ("normal", "minor_friction", "major_friction")
    ]
    assert np.all(np.diff(leaking) > 1.0)
    assert np.all(np.diff(rubbing) > 1000.0)
