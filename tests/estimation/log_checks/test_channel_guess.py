import numpy as np
import pytest

from estimation.log_checks.channel_guess import ChannelGuess, _correlation, _differences, guess_channels
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.headings import Heading
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()
NAMES = ("time_s", "motor_speed_rad_s", "position_m", "velocity_m_s", "differential_pressure_pa")


@pytest.fixture(scope="module")
def record() -> Record:
    rng = np.random.default_rng(5)
    drive = make_drive("prbs", 4.0, 1e-3, HEALTHY, rng)
    return simulate(LUMPED, drive, 1e-3, HEALTHY, sensors=BENCH, rng=rng).slice(0, 4000)


def guess(record: Record, names: dict[str, str], scale: dict[str, float]) -> dict[str, ChannelGuess]:
    columns = {"time_s": record.time, **record.channels}
    headings = [Heading(names.get(name, name)) for name in columns]
    values = {place: one * scale.get(name, 1.0) for place, (name, one) in enumerate(columns.items())}
    return {one.guess.channel: one for one in guess_channels(headings, values, HEALTHY)}


def test_the_slope_of_position_is_guessed_as_velocity_under_any_name(record: Record) -> None:
    found = guess(record, {"velocity_m_s": "Kanal 7", "position_m": "Weg [mm]"}, {"position_m": 1e3})
    assert found["velocity_m_s"].guess.name == "Kanal 7"
    assert "is_slope" in [note.code for note in found["velocity_m_s"].why]


def test_a_column_named_pressure_is_not_guessed_as_velocity(record: Record) -> None:
    """In a German log without velocity, pressure was taken for velocity in mm/s."""
    named = [("t", record.time), ("Weg", 1e3 * record["position_m"]), ("Druck", 1e3 * record["velocity_m_s"])]
    headings = [Heading(name) for name, _ in named]
    found = guess_channels(headings, {place: one for place, (_, one) in enumerate(named)}, HEALTHY)
    assert {one.guess.channel: one.guess.name for one in found if one.guess.name == "Druck"} == {
        "differential_pressure_pa": "Druck"
    }


def test_the_time_column_is_recognised_despite_a_misleading_name(record: Record) -> None:
    found = guess(record, {"time_s": "A", "position_m": "time"}, {})
    assert found["time_s"].guess.name == "A"


def test_a_missing_unit_is_guessed_and_lowers_the_confidence(record: Record) -> None:
    found = guess(record, {"position_m": "Weg", "time_s": "t"}, {"position_m": 1e3, "time_s": 1e3})
    assert (found["position_m"].guess.unit, found["time_s"].guess.unit) == ("mm", "ms")
    assert "unit_guessed" in [note.code for note in found["position_m"].why]
    assert found["position_m"].guess.sure < 0.75


@pytest.mark.parametrize(("unit", "factor"), [("in/s", 1.0 / 0.0254), ("mm/s", 1e3), ("m/s", -1.0)])
def test_a_velocity_without_unit_gets_the_unit_of_the_slope_of_position(
    record: Record, unit: str, factor: float
) -> None:
    """By size alone, in/s or a slow velocity in mm/s would be taken for m/s; a reversed sensor has a unit too."""
    scale = {"position_m": 1.0 / 0.0254, "velocity_m_s": factor}
    found = guess(record, {"position_m": "Stroke (in)", "velocity_m_s": "Vel"}, scale)["velocity_m_s"]
    assert (found.guess.unit, found.why[-1].code) == (unit, "unit_of_slope")


def test_a_velocity_unlike_the_slope_of_position_gets_its_unit_by_size(record: Record) -> None:
    found = guess(record, {"position_m": "Weg [mm]", "velocity_m_s": "Vel"}, {"position_m": 1e3, "velocity_m_s": 5.0})
    assert found["velocity_m_s"].why[-1].code == "unit_guessed"


def test_columns_with_the_projects_own_names_are_guessed_with_confidence(record: Record) -> None:
    found = guess(record, {}, {})
    assert {name for name, one in found.items() if one.guess.sure > 0.9} >= set(NAMES)


def test_likeness_of_columns_is_their_correlation() -> None:
    one, other = np.random.default_rng(2).standard_normal((2, 50))
    wanted = np.corrcoef(one, other)[0, 1]
    assert _correlation(one + 7.0, 3.0 * other - 2.0) == pytest.approx(wanted)
    assert _correlation(np.ones(50), other) == 0.0


T = 0.01 * np.arange(3000)
SWING = np.sin(2.0 * T) + 0.4 * np.sin(0.7 * T)


def guesses(**columns: np.ndarray) -> dict[str, ChannelGuess]:
    """Guess channels of columns by name; double underscores open the bracket of a unit."""
    headings = [Heading(name.replace("__", " [").replace("_per_", "/") + "]" * ("__" in name)) for name in columns]
    return {one.guess.channel: one for one in guess_channels(headings, dict(enumerate(columns.values())), HEALTHY)}


def told(one: ChannelGuess) -> list[str]:
    return [str(note.code) for note in one.why]


def test_a_steadily_rising_column_in_mm_is_not_guessed_as_time() -> None:
    found = guesses(A=T, Position__mm=100.0 + T)
    assert found["time_s"].guess.name == "A"
    assert "increases" in told(found["time_s"])
    assert "increases" not in told(found["position_m"])


def test_the_slope_of_position_is_velocity_and_a_similar_column_is_motor_speed() -> None:
    speed = SWING + 0.5 * np.sin(5.0 * T)
    found = guesses(t__s=T, way__mm=np.cumsum(SWING), A=SWING, B=speed)
    assert (found["velocity_m_s"].guess.name, found["motor_speed_rad_s"].guess.name) == ("A", "B")
    assert "has_slope" in told(found["position_m"])
    assert "is_slope" in told(found["velocity_m_s"])
    assert "follows" in told(found["motor_speed_rad_s"])


def test_a_pressure_equal_to_the_slope_of_position_is_not_guessed_as_velocity() -> None:
    found = guesses(t__s=T, way__mm=np.cumsum(SWING), load__bar=SWING)
    assert "velocity_m_s" not in found
    assert "has_slope" in told(found["position_m"])


def test_a_pressure_that_is_the_difference_of_two_is_the_differential_one() -> None:
    rng = np.random.default_rng(1)
    left, right = 40.0 + np.cumsum(rng.normal(size=3000)), 40.0 + np.cumsum(rng.normal(size=3000))
    found = guesses(t__s=T, P1__bar=left, P2__bar=right, P3__bar=left - right)
    assert found["differential_pressure_pa"].guess.name == "P3 [bar]"
    assert "is_difference" in told(found["differential_pressure_pa"])
    alike = guesses(t__s=T, P1__bar=left, P2__bar=2.0 * left, P3__bar=left - right)
    assert all("is_difference" not in told(one) for one in alike.values())


def test_nearly_equal_columns_are_not_taken_for_a_difference_of_two() -> None:
    rng = np.random.default_rng(4)
    reference = np.sin(T)
    position = reference + 0.02 * np.sin(7.0 * T) + 1e-3 * rng.standard_normal(len(T))
    voltage = -4.0 * np.sin(7.0 * T)
    headings = [Heading(name) for name in ("t", "a", "b", "c")]
    found = guess_channels(headings, dict(enumerate((T, voltage, position, reference))), HEALTHY)
    assert "is_difference" not in [note.code for one in found for note in one.why]


def test_only_a_pressure_correlated_with_motor_speed_is_noted_to_follow_it() -> None:
    found = guesses(t__s=T, rpm=SWING, p__bar=SWING + 0.5 * np.sin(9.0 * T))
    assert "follows" in told(found["differential_pressure_pa"])
    found = guesses(t__s=T, rpm=SWING, p__bar=np.sin(9.0 * T))
    assert "follows" not in told(found["differential_pressure_pa"])


def test_a_column_opposed_to_the_motion_is_noted_to_oppose_it() -> None:
    found = guesses(t__s=T, rpm=SWING, p__bar=-SWING - 0.5 * np.sin(9.0 * T))
    assert "opposes" in told(found["differential_pressure_pa"])
    assert "follows" not in told(found["differential_pressure_pa"])
    found = guesses(t__s=T, way__mm=np.cumsum(SWING), A=SWING, B=-SWING - 0.5 * np.sin(5.0 * T))
    assert "opposes" in told(found["motor_speed_rad_s"])


@pytest.mark.parametrize(
    "dull",
    [np.zeros(3000), np.full(3000, 5.0), np.full(3000, 1e250), np.where(T < 0.1, T, np.nan)],
    ids=["zero", "constant", "huge", "hardly there"],
)
def test_a_constant_or_mostly_missing_column_is_not_guessed_as_motor_speed(dull: np.ndarray) -> None:
    found = guesses(t__s=T, way__mm=np.cumsum(SWING), A=SWING, B=dull)
    assert found["velocity_m_s"].guess.name == "A"
    assert "motor_speed_rad_s" not in found


def test_a_column_of_dates_is_guessed_as_time() -> None:
    stamps = np.datetime64("2026-03-01", "ns") + (1e9 * T).astype("timedelta64[ns]")
    (found,) = guess_channels([Heading("when", stamped=True)], {0: stamps}, HEALTHY)
    assert (found.guess.channel, told(found)) == ("time_s", ["dates"])


@pytest.mark.parametrize(
    ("name", "size", "unit"),
    [
        ("Druckdifferenz", 25.0, "bar"),
        ("Druckdifferenz", 2.5e6, "Pa"),
        ("Motordrehzahl", 150.0, "rad/s"),
        ("Motordrehzahl", 1.5 * HEALTHY.motor_speed_limit * 60.0 / (2.0 * np.pi), "rpm"),
        ("Geschwindigkeit", 300.0, "mm/s"),
        ("Geschwindigkeit", float("nan"), "m/s"),
    ],
)
def test_the_unit_is_the_first_in_which_a_channel_has_a_usual_size(name: str, size: float, unit: str) -> None:
    (found,) = (
        one for one in guesses(t__s=T, **{name: size * SWING / np.abs(SWING).max()}).values() if one.guess.name == name
    )
    assert found.guess.unit == unit
    assert "unit_guessed" in told(found)


def test_a_column_of_another_length_does_not_change_the_guesses(record: Record) -> None:
    columns = dict(enumerate([record.time, *record.channels.values(), np.arange(900.0)]))
    headings = [Heading(name) for name in ("time_s", *record.channels, "other")]
    found = {one.guess.channel: one.guess.place for one in guess_channels(headings, columns, HEALTHY)}
    assert found["velocity_m_s"] == headings.index(Heading("velocity_m_s"))


def test_the_difference_of_two_columns_is_found_among_hundreds_without_units() -> None:
    noise = np.random.default_rng(2).standard_normal((130, 600))
    noise[120] = 2.0 * noise[7] - 3.0 * noise[40]
    assert _differences(noise[[7, 40, 120]]) == [(1, 0, 2), (2, 0, 1)]
    columns = dict(enumerate([1e-3 * np.arange(600), *noise]))
    headings = [Heading("time_s"), *(Heading(f"p{place}") for place in range(len(noise)))]
    # this takes a tenth of a second; comparing every three columns took minutes
    assert guess_channels(headings, columns, HEALTHY)
