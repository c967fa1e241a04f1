"""Wrong signs, units and names of a diaphragm motor's channels, taken back in its signature."""

from collections.abc import Callable

import numpy as np
import pytest

from estimation.diaphragm_motor.channel_mistakes import mistakes_that_explain
from estimation.diaphragm_motor.signature import DRIVE, POSITION, Signature, logged_signature
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import BENCH_SENSORS, ELECTRODES, SAMPLE_TIME, motor_drive, simulate_motor
from plant.log.record import Record

LOG = simulate_motor(
    DiaphragmMotorParameters(),
    motor_drive(480.0, 200.0, 0.2, SAMPLE_TIME),
    SAMPLE_TIME,
    sensors=BENCH_SENSORS,
    rng=np.random.default_rng(5),
)
SEEN = logged_signature(LOG)


def changed(**channels: np.ndarray) -> Record:
    return LOG.replace(**channels)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: changed(electrode_4_v=-LOG["electrode_4_v"]), "electrode_4_v has the opposite sign"),
        (
            lambda: changed(electrode_2_v=LOG["electrode_5_v"], electrode_5_v=LOG["electrode_2_v"]),
            "electrode_2_v and electrode_5_v are swapped",
        ),
        (lambda: changed(**{n: -LOG[n] for n in ELECTRODES}), "all electrodes have the opposite sign"),
        (lambda: changed(**{n: 1e3 * LOG[n] for n in ELECTRODES}), "all electrodes are in mV"),
        (lambda: changed(**{DRIVE: -LOG[DRIVE]}), "drive_voltage_v has the opposite sign"),
        (lambda: changed(**{POSITION: 1e3 * LOG[POSITION]}), "position_m is in mm"),
        (lambda: changed(**{POSITION: 1e6 * LOG[POSITION]}), "position_m is in um"),
        (
            lambda: changed(**{POSITION: -LOG[POSITION]}),
            "position_m has the opposite sign (or the valve retracts: spool = -1)",
        ),
    ],
)
def test_a_mistake_is_the_one_whose_reversal_gives_the_true_signature(made: Callable[[], Record], said: str) -> None:
    scale = np.abs(SEEN.values).max() * np.ones(len(SEEN.values))
    scale[-1] = abs(SEEN.velocity)

    def is_the_true_one(one: Signature) -> bool:
        return bool(
            np.all(np.abs(one.values - SEEN.values) < 1e-6 * scale)
            and np.allclose(one.covariance, SEEN.covariance, rtol=1e-6, atol=0.0)
        )

    assert mistakes_that_explain(logged_signature(made()), is_the_true_one) == (said,)


def test_a_true_signature_that_no_motor_explains_has_no_mistake() -> None:
    assert mistakes_that_explain(SEEN, lambda _: False) == ()
