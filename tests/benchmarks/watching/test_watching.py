import numpy as np
import pytest

from benchmarks.diagnosis.scores import alarm_rate, median_delay
from benchmarks.watching.watching import (
    PIECE,
    CircuitStream,
    at_oil_temperature,
    detect_fault,
    false_alarms,
    learnt_watch,
)
from plant.eha.circuit_parameters import CircuitParameters
from plant.errors import HydrostateError


def test_warm_oil_has_more_leakage_less_friction_and_a_lower_bulk_modulus() -> None:
    cold = CircuitParameters()
    warm = at_oil_temperature(cold, 10.0)
    assert warm.leakage_coefficient / cold.leakage_coefficient == pytest.approx(np.exp(0.3))
    assert warm.cylinder_leakage / cold.cylinder_leakage == pytest.approx(np.exp(0.3))
    assert warm.friction_linear / cold.friction_linear == pytest.approx(np.exp(-0.3))
    assert warm.bulk_modulus / cold.bulk_modulus == pytest.approx(0.95)


@pytest.mark.parametrize("seconds", [0.0, 1.5 * PIECE])
def test_an_empty_or_too_long_piece_is_refused(seconds: float) -> None:
    with pytest.raises(HydrostateError, match="piece"):
        CircuitStream(0).run(seconds)


@pytest.mark.slow
def test_minor_faults_are_found_within_half_a_second_and_false_alarms_come_at_the_rate_set() -> None:
    running, watch = learnt_watch(11, 0.5, false_alarms=10.0)
    for condition in ("minor_leakage", "minor_friction"):
        found = [detect_fault(running, watch, condition, seed) for seed in range(10)]
        assert median_delay([one.delay for one in found])[0] <= 0.5
        assert sum(one.covered for one in found) >= 8
    low, high = alarm_rate(len(false_alarms(running, watch, 3.0)), 3.0, confidence=0.99)[1]
    assert low <= 10.0 <= high
