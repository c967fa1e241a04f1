"""A faulty sensor changes only its own channel, from its start time on and by its stated amount."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant.errors import LogError, RigError
from plant.log.record import Record
from plant.sensors.faults import Kind, SensorFault, with_fault

COUNT, SAMPLE_TIME, START = 400, 1e-2, 1.5
TIME = SAMPLE_TIME * np.arange(COUNT)
LOG = Record(
    SAMPLE_TIME,
    {"position_m": np.sin(TIME), "velocity_m_s": np.cos(TIME), "true_position_m": np.sin(TIME)},
)
SIZES: dict[Kind, float] = {
    "bias": 0.2,
    "gain": -0.3,
    "drift": 0.05,
    "freeze": 0.0,
    "saturation": 0.4,
    "dropout": 0.5,
}


def seen(kind: Kind, growth: float = 0.0) -> np.ndarray:
    fault = SensorFault(channel="position_m", kind=kind, size=SIZES[kind], start=START, growth=growth)
    return with_fault(LOG, fault, np.random.default_rng(0))["position_m"]


@pytest.mark.parametrize("kind", SIZES)
def test_nothing_changes_before_the_fault_nor_in_other_channels(kind: Kind) -> None:
    fault = SensorFault(channel="position_m", kind=kind, size=SIZES[kind], start=START)
    found = with_fault(LOG, fault, np.random.default_rng(0))
    np.testing.assert_array_equal(found["position_m"][TIME < START], LOG["position_m"][TIME < START])
    assert not np.array_equal(found["position_m"], LOG["position_m"], equal_nan=True)
    for name in ("velocity_m_s", "true_position_m"):
        np.testing.assert_array_equal(found[name], LOG[name])
    assert found.metadata["sensor_fault_position_m"]["kind"] == kind


def test_each_kind_of_fault_changes_the_readings_as_defined() -> None:
    healthy, after = LOG["position_m"], TIME >= START
    np.testing.assert_allclose(seen("bias")[after], healthy[after] + 0.2)
    np.testing.assert_allclose(seen("gain")[after], 0.7 * healthy[after])
    np.testing.assert_allclose(seen("drift")[after], healthy[after] + 0.05 * (TIME[after] - START))
    assert np.ptp(seen("freeze")[after]) == 0.0
    assert seen("freeze")[-1] == healthy[~after][-1]
    assert np.max(np.abs(seen("saturation")[after])) == 0.4


def test_half_of_the_samples_drop_out() -> None:
    missing = np.isnan(seen("dropout")[TIME >= START])
    assert abs(np.mean(missing) - 0.5) < 4.0 * 0.5 / np.sqrt(len(missing))


@given(st.floats(0.1, 2.0), st.sampled_from(["bias", "gain"]))
def test_a_growing_fault_grows_linearly_and_then_stays(growth: float, kind: Kind) -> None:
    change = seen(kind, growth) - LOG["position_m"]
    grown = np.clip((TIME - START) / growth, 0.0, 1.0)
    full = SIZES[kind] if kind == "bias" else SIZES[kind] * LOG["position_m"]
    np.testing.assert_allclose(change, full * grown, atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"kind": "noise"}, "must be one of bias, gain"),
        ({"kind": "bias", "size": float("nan")}, "size of a sensor fault must be finite, got nan"),
        ({"kind": "bias", "start": -1.0}, "must not be negative"),
        ({"kind": "freeze", "growth": 1.0}, "only bias and gain grow"),
        ({"kind": "saturation", "size": 0.0}, "must be positive, got 0.0"),
        ({"kind": "dropout", "size": 1.5}, "between 0 and 1, got 1.5"),
    ],
)
def test_an_invalid_fault_is_refused(arguments: dict[str, float], message: str) -> None:
    with pytest.raises(RigError, match=message):
        SensorFault(channel="position_m", **arguments)  # type: ignore[arg-type]


def test_a_missing_channel_and_a_missing_generator_are_named_in_the_error() -> None:
    with pytest.raises(LogError, match="pressure_a_pa"):
        with_fault(LOG, SensorFault(channel="pressure_a_pa", kind="bias", size=1.0))
    with pytest.raises(RigError, match="needs rng"):
        with_fault(LOG, SensorFault(channel="position_m", kind="dropout", size=0.1))
