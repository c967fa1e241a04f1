import numpy as np
import pytest

from plant.errors import LogError
from plant.log.columns import TRUTH_PREFIX
from plant.log.notes import LogCode
from plant.log.plausibility import implausibility_notes, require_measurable

T = 1e-3
TIME = T * np.arange(4000)
RNG = np.random.default_rng(5)
SPEED = 120.0 * np.sin(2.0 * np.pi * TIME) + 0.05 * RNG.standard_normal(len(TIME))
TRUE_VELOCITY = 0.04 * np.sin(2.0 * np.pi * TIME)
LOG = {
    "motor_speed_rad_s": SPEED,
    "position_m": np.round(np.cumsum(TRUE_VELOCITY) * T, 6),
    "velocity_m_s": TRUE_VELOCITY + 1e-3 * RNG.standard_normal(len(TIME)),
    "differential_pressure_pa": 3e5 * np.sin(2.0 * np.pi * TIME),
    "pressure_a_pa": 1e6 + 2e5 * np.sin(2.0 * np.pi * TIME),
    "pressure_b_pa": 1e6 - 2e5 * np.sin(2.0 * np.pi * TIME),
    "motor_voltage_v": 4.0 * np.sin(2.0 * np.pi * TIME),
}
OUT_OF_RANGE = {LogCode.CHANNEL_LARGE, LogCode.CHANNEL_SMALL}
AT_ODDS = {LogCode.POSITION_AND_VELOCITY_UNITS, LogCode.TRAVEL_UNITS}


def test_a_plausible_log_gives_no_note() -> None:
    assert implausibility_notes(T, LOG) == []


@pytest.mark.parametrize("factor", [1e3, 1e-3])
@pytest.mark.parametrize("name", list(LOG))
def test_a_channel_wrong_by_a_thousand_is_noticed(name: str, factor: float) -> None:
    notes = implausibility_notes(T, {**LOG, name: factor * LOG[name]})
    assert notes
    assert {note.code for note in notes} <= OUT_OF_RANGE | AT_ODDS
    assert all(note.data["channel"] == name for note in notes if note.code in OUT_OF_RANGE)


@pytest.mark.parametrize("factor", [1e3, 1e-3])
@pytest.mark.parametrize("name", ["position_m", "velocity_m_s"])
def test_a_unit_error_of_position_or_velocity_is_noticed_without_the_other_channel(name: str, factor: float) -> None:
    slipped = {"motor_speed_rad_s": SPEED, name: factor * LOG[name]}
    (note,) = implausibility_notes(T, slipped)
    assert note.code in OUT_OF_RANGE | {LogCode.TRAVEL_UNITS}
    assert note.data["channel"] == name


@pytest.mark.parametrize("factor", [1e3, 1e-3])
def test_a_sample_time_wrong_by_a_thousand_is_noticed(factor: float) -> None:
    (note,) = implausibility_notes(factor * T, LOG)
    assert note.code == (LogCode.SAMPLE_TIME_LONG if factor > 1.0 else LogCode.SAMPLE_TIME_SHORT)
    assert note.data["sample_time_s"] == factor * T


@pytest.mark.parametrize("factor", [50.0, 0.02])
def test_a_sample_time_within_bounds_that_contradicts_the_motion_is_noticed(factor: float) -> None:
    (note,) = implausibility_notes(factor * T, LOG)
    assert note.code == LogCode.POSITION_AND_VELOCITY_UNITS
    assert note.data["ratio"] == pytest.approx(1.0 / factor, rel=0.02)


def test_a_note_gives_the_value_the_usual_limit_and_the_likely_unit_error() -> None:
    (note,) = implausibility_notes(T, {**LOG, "position_m": 1e3 * LOG["position_m"]})
    assert note.code == LogCode.CHANNEL_LARGE
    assert (note.data["channel"], note.data["limit"]) == ("position_m", 5.0)
    assert note.data["size"] == pytest.approx(12.73, abs=0.01)
    assert str(note) == "position_m spans 12.7 m, but at most 5 m is usual: check the unit (mm read as m?)"


@pytest.mark.parametrize("seed", range(12))
def test_sensor_noise_on_a_stuck_piston_is_not_taken_for_a_unit_error(seed: int) -> None:
    rng = np.random.default_rng(seed)
    position = np.round(2e-7 * rng.standard_normal(len(TIME)) + 3e-7, 6)
    noisy = 1e-3 * rng.standard_normal(len(TIME)) + 2e-4
    for velocity in (noisy, np.gradient(position, T)):
        stuck = {**LOG, "position_m": position, "velocity_m_s": velocity}
        assert implausibility_notes(T, stuck) == []


def test_a_stuck_piston_measured_with_fine_resolution_is_not_taken_for_a_unit_error() -> None:
    position = 1e-8 * np.random.default_rng(2).standard_normal(len(TIME))
    assert implausibility_notes(T, {"motor_speed_rad_s": SPEED, "position_m": position}) == []


def test_a_log_in_which_nothing_moves_says_so() -> None:
    still = np.zeros(len(TIME))
    (note,) = implausibility_notes(T, {**LOG, "position_m": still, "velocity_m_s": still})
    assert note.code == LogCode.NOTHING_MOVES
    assert note.data["channels"] == "position_m and velocity_m_s"
    (note,) = implausibility_notes(T, {**LOG, "motor_speed_rad_s": still})
    assert note.code == LogCode.SPEED_CONSTANT
    (note,) = implausibility_notes(T, dict.fromkeys(LOG, still))
    assert note.code == LogCode.NOTHING_MEASURED


def test_missing_samples_do_not_hide_a_unit_error() -> None:
    position = 1e3 * LOG["position_m"] / 4.0
    position[100:150] = np.nan
    (note,) = implausibility_notes(T, {**LOG, "position_m": position})
    assert note.code == LogCode.POSITION_AND_VELOCITY_UNITS
    assert note.data["ratio"] == pytest.approx(250.0, rel=0.02)


def test_motor_speed_alone_gives_no_note_on_units() -> None:
    assert implausibility_notes(T, {"motor_speed_rad_s": SPEED}) == []


def test_values_beyond_any_sensor_are_refused_but_not_missing_or_simulated_true_values() -> None:
    require_measurable(
        {"position_m": np.full(3, np.nan), f"{TRUTH_PREFIX}x": np.array([1e300]), "force_n": np.zeros(2)}, "a"
    )
    for size, said in (
        (1e16, r"reaches 1e\+16, no sensor gives more than"),
        (1e-31, "reaches only 1e-31, no sensor gives less"),
    ):
        with pytest.raises(LogError, match=f"a.csv: position_m {said}"):
            require_measurable({"force_n": np.ones(2), "position_m": np.array([0.0, -size])}, "a.csv")
