"""Units by the piston's travel per pumped volume: whether a piston that hardly moves is seen to move at all."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from estimation.log_checks import pump_units
from estimation.log_checks.channel_names import POSITION, SPEED
from plant.log.record import Record


def test_a_position_is_resolved_only_if_its_motion_exceeds_its_noise() -> None:
    rng = np.random.default_rng(1)
    noise = 1e-6 * rng.standard_normal(2000)
    for size, resolved in ((0.1 * pump_units.RESOLVED, False), (10.0 * pump_units.RESOLVED, True)):
        moved = 1e-6 * size * np.sin(1e-3 * np.pi * np.arange(2000))
        log = Record(1e-3, {POSITION: moved + noise})
        blocks: Any = SimpleNamespace(position=moved)
        assert pump_units._exceeds_position_noise(log, blocks) is resolved
    absent: Any = SimpleNamespace(position=None)
    assert not pump_units._exceeds_position_noise(Record(1e-3, {SPEED: noise}), absent)
