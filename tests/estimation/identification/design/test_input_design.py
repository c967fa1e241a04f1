import numpy as np
import pytest

from estimation.identification import LinearModel
from estimation.identification.design.input_design import (
    Limits,
    multisine_for,
    prbs_for,
    predicted_covariance,
    rank_inputs,
    violations,
)
from plant.errors import HydrostateError

LIMITS = Limits(125.66)


def held(seconds: float, n: int = 20_000) -> np.ndarray:
    levels = np.random.default_rng(1).choice([-1.0, 1.0], n // round(seconds * 1e3) + 1)
    return 125.66 * np.repeat(levels, round(seconds * 1e3))[:n]


def test_a_five_hertz_clock_leaves_the_gain_at_25_hz_several_times_less_certain(table6: dict[str, LinearModel]) -> None:
    inputs = {"200 ms": held(0.2), "20 ms": held(0.02), "10 ms": held(0.01)}
    table = rank_inputs(table6["major_leakage"], inputs, 1e-3, np.array([25.0]), LIMITS)
    assert table.index[-1] == "200 ms"
    assert table.loc["200 ms", "at_25_hz"] > 3.5 * table.loc["10 ms", "at_25_hz"]
    assert table.loc["200 ms", "steady_state"] < table.loc["10 ms", "steady_state"]


def test_a_prbs_designed_for_a_bandwidth_is_as_accurate_there_as_the_best_clock(table6: dict[str, LinearModel]) -> None:
    inputs = {
        "made": prbs_for(25.0, 1e-3, LIMITS, slowest=0.1, duration=20.0),
        "10 ms": held(0.01),
        "50 ms": held(0.05),
    }
    table = rank_inputs(table6["major_leakage"], inputs, 1e-3, np.array([25.0]), LIMITS)
    assert table.loc["made", "at_25_hz"] < 1.1 * table["at_25_hz"].min()


def test_predicted_deviations_fall_with_the_square_root_of_time(table6: dict[str, LinearModel]) -> None:
    short, long = (predicted_covariance(table6["major_leakage"], held(0.05, n), 1e-3) for n in (5_000, 20_000))
    np.testing.assert_allclose(np.sqrt(np.diag(short) / np.diag(long)), 2.0, rtol=0.3)


def test_a_multisine_has_power_at_its_lines_only() -> None:
    u = multisine_for(np.array([1.0, 2.0, 5.0]), 1e-2, LIMITS, duration=10.0)
    spectrum = np.abs(np.fft.rfft(u))
    assert set(np.flatnonzero(spectrum > 1e-6 * spectrum.max())) == {10, 20, 50}
    assert np.abs(u).max() == pytest.approx(125.66)


def test_limits_violated_by_an_input_are_named(table6: dict[str, LinearModel]) -> None:
    model, u = table6["major_leakage"], np.full(3_000, 130.0)
    found = violations(model, u, Limits(125.66, stroke=0.05, output=0.01))
    assert [sentence.split()[1] for sentence in found] == ["input", "output", "stroke"]
    assert violations(model, held(0.02, 500), Limits(125.66)) == []
    (idle,) = violations(model, np.full(100, 5.0), Limits(125.66, dead_zone=10.0))
    assert "dead zone for 100 %" in idle


def test_an_infeasible_input_design_is_refused() -> None:
    with pytest.raises(HydrostateError, match="needs samples of"):
        prbs_for(1_000.0, 1e-3, LIMITS, slowest=0.1, duration=1.0)
    with pytest.raises(HydrostateError, match="frequencies must lie"):
        multisine_for(np.array([600.0]), 1e-3, LIMITS, duration=1.0)
    with pytest.raises(HydrostateError, match="dead_zone < speed"):
        Limits(1.0, dead_zone=2.0)
