"""Defaults of a log's model and of its signals."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.identification import identify_record
from estimation.identification.from_record import record_signals
from estimation.identification.signals.etfe import etfe
from estimation.identification.signals.preprocess import zero_phase_filter
from plant.log.record import Record

RNG = np.random.default_rng(8)
U = np.repeat(RNG.choice([-1.0, 1.0], 150), 4)
Y = np.asarray(lfilter([0.3, 0.2, 0.1], [1.0, -1.1, 0.4], U)) + 0.05 * RNG.standard_normal(600)
LOG = Record(1e-3, {"motor_speed_rad_s": U, "velocity_m_s": Y, "force_n": -Y})


@pytest.mark.parametrize(
    ("made", "named"),
    [
        (
            lambda **given: identify_record(LOG, **given).to_dict(),
            {
                "output": "velocity_m_s",
                "input": "motor_speed_rad_s",
                "sample_time": 1e-3,
                "n_numerator": 3,
                "n_denominator": 2,
                "delay": 0,
            },
        ),
        (lambda **given: record_signals(LOG, **given), {"output": "velocity_m_s", "sample_time": 1e-3}),
        (lambda **given: zero_phase_filter(U, Y, 1e-3, **given), {"cutoff_hz": 30.0, "order": 12}),
        (lambda **given: etfe(U, Y, 1e-3).gain_band(**given), {"level": 0.95}),
    ],
)
def test_omitted_arguments_have_the_expected_defaults(made: Callable[..., Any], named: dict[str, Any]) -> None:
    np.testing.assert_equal(made(), made(**named))
