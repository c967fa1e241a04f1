"""A log's truth without pressure: that of a plain log if only the pressure sensor is strange."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.open_benchmark.draws import draw_plain
from experiments.open_benchmark.kinds import KINDS
from experiments.open_benchmark.logger import PRESSURES
from experiments.open_benchmark.score import PRESSURE_PREFIX, without_pressure

NAMES = [name for name in KINDS if name.startswith(PRESSURE_PREFIX)]


@pytest.mark.parametrize("name", NAMES)
def test_kinds_named_after_pressure_change_only_the_pressure_sensors(name: str) -> None:
    plain = draw_plain("normal", "steps", np.random.default_rng(0))
    strange = KINDS[name].draw(plain, np.random.default_rng(1))
    assert strange != plain
    sensors = {**strange.logger.sensors, **{one: plain.logger.sensors[one] for one in PRESSURES}}
    channels = plain.logger.channels  # a kind may log the two chamber pressures instead of their difference
    assert replace(strange, logger=replace(strange.logger, sensors=sensors, channels=channels)) == plain


def test_without_pressure_a_pressure_fault_counts_as_its_plain_condition() -> None:
    reversed_ = {"set": "pressure_reversed", "accept": "unknown", "condition": "minor_leakage", "named": "sign"}
    assert without_pressure(reversed_) == {**reversed_, "accept": "minor_leakage", "named": ""}
    for other in ({**reversed_, "set": "speed_sign_reversed"}, {"set": "pressure_reversed", "accept": "unknown"}):
        assert without_pressure(other) == other
