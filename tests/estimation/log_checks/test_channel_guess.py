import numpy as np
import pytest

from estimation.log_checks.channel_guess import ChannelGuess, _alike, guess_channels
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


def test_velocity_is_the_slope_of_position_whatever_it_is_called(record: Record) -> None:
    found = guess(record, {"velocity_m_s": "Kanal 7", "position_m": "Weg [mm]"}, {"position_m": 1e3})
    assert found["velocity_m_s"].guess.name == "Kanal 7"
    assert "is_slope" in [note.code for note in found["velocity_m_s"].why]


def test_swapped_names_lose_against_physics_of_the_clock(record: Record) -> None:
    found = guess(record, {"time_s": "A", "position_m": "time"}, {})
    assert found["time_s"].guess.name == "A"


def test_a_unit_that_is_not_given_is_guessed_and_makes_less_sure(record: Record) -> None:
    found = guess(record, {"position_m": "Weg", "time_s": "t"}, {"position_m": 1e3, "time_s": 1e3})
    assert (found["position_m"].guess.unit, found["time_s"].guess.unit) == ("mm", "ms")
    assert "unit_guessed" in [note.code for note in found["position_m"].why]
    assert found["position_m"].guess.sure < 0.75


def test_own_names_are_sure(record: Record) -> None:
    found = guess(record, {}, {})
    assert {name for name, one in found.items() if one.guess.sure > 0.9} >= set(NAMES)


def test_columns_are_alike_whatever_their_offset_and_unit() -> None:
    one, other = np.random.default_rng(2).standard_normal((2, 50))
    wanted = np.corrcoef(one, other)[0, 1]
    assert _alike(one + 7.0, 3.0 * other - 2.0) == pytest.approx(wanted)
    assert _alike(np.ones(50), other) == 0.0
