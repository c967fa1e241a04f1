"""Settling time of a run under velocity control."""

import numpy as np

from estimation.diaphragm_motor.control import ControlledRun


def test_a_run_without_samples_between_two_times_has_an_infinite_settling_time() -> None:
    time, still = np.arange(1.0, 5.0), np.zeros(4)
    run = ControlledRun(time, np.ones(4), still, np.ones(4), still, still)
    assert run.settling(0.0, 4.0) == 0.0
    assert run.settling(4.0, 8.0) == np.inf
