"""Positions are corrected for the leakage between samples of a slow log, unless it has no effect."""

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.fits.flow.log import flow_log
from estimation.fits.flow.swept import with_sweep_correction
from plant.eha.model import EhaParameters
from plant.log.record import Record

P, SAMPLE, EMPTIES = EhaParameters(), 2e-3, 3e-3
VALUES = {"bulk_modulus": P.bulk_modulus, "leakage_coefficient": P.chamber_volume / P.bulk_modulus / EMPTIES}
TIME = SAMPLE * np.arange(2000)
TURNED = 2.0 * np.pi * 25.0 * TIME


def seen(values: dict[str, float]) -> Array:
    channels = {
        "motor_speed_rad_s": 50.0 * np.cos(TURNED),
        "position_m": 1e-3 * np.sin(TURNED),
        "differential_pressure_pa": 1e6 * np.cos(TURNED) + np.random.default_rng(1).normal(0.0, 1e4, len(TIME)),
    }
    record = Record(SAMPLE, channels)
    log = flow_log(record, P, {}, dict.fromkeys(channels, 1e-12))
    return with_sweep_correction(log, P, values).drives[:, 1]


def emptied(position: Array) -> Array:
    """Return pressure over stiffness of a chamber that leaks empty, swept at constant velocity between samples."""
    kept, out = np.exp(-SAMPLE / EMPTIES), np.zeros(len(position))
    for k, velocity in enumerate(np.diff(position) / SAMPLE):
        out[k + 1] = kept * out[k] + velocity * EMPTIES * (1.0 - kept)
    return out


def test_straight_lines_between_corrected_positions_leak_as_much_as_the_pistons_true_course() -> None:
    rate = 2.0 * np.pi * 25.0
    answer = 1e-3 * 1j * rate / (1j * rate + 1.0 / EMPTIES)  # response to exp(j w t)
    wanted = (answer * np.exp(1j * TURNED)).imag
    straight, led = (emptied(one)[100:-2] - wanted[100:-2] for one in (1e-3 * np.sin(TURNED), seen(VALUES)))
    assert np.std(led) < 0.1 * np.std(straight)


@pytest.mark.parametrize("share", [0.05, 20.0])
def test_positions_are_unchanged_if_leakage_is_small_or_the_log_too_slow(share: float) -> None:
    leaking = {**VALUES, "leakage_coefficient": share * VALUES["leakage_coefficient"]}
    np.testing.assert_array_equal(seen(leaking), seen({**leaking, "leakage_coefficient": 0.0}))
