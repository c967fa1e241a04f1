"""A sensor that holds one value for long is refused."""

import numpy as np
import pytest

from estimation.log_checks.longest_hold import require_live
from plant.errors import LogError
from plant.log.record import Record

WAVE = np.sin(np.arange(1000.0))


def log(values: np.ndarray) -> Record:
    return Record(1e-3, {"position_m": values, "stack_force_n": WAVE})


@pytest.mark.parametrize("first", [0, 400, 949])
def test_a_value_that_is_held_for_more_than_a_twentieth_of_the_log_is_refused(first: int) -> None:
    held = WAVE.copy()
    held[first : first + 51] = 2.0
    with pytest.raises(LogError, match="position_m holds one value for 51 ms"):
        require_live(log(held), ["stack_force_n", "position_m"])
    require_live(log(held), ["stack_force_n"])
    held[first] = 3.0
    require_live(log(held), ["position_m"])


def test_a_coarse_sensor_that_follows_its_quantity_is_live() -> None:
    require_live(log(np.round(4.0 * WAVE)), ["position_m"])


def test_a_repeated_value_in_a_log_of_three_samples_is_refused() -> None:
    with pytest.raises(LogError, match="position_m holds one value for 2 ms"):
        require_live(Record(1e-3, {"position_m": [0.0, 1.0, 1.0]}), ["position_m"])
