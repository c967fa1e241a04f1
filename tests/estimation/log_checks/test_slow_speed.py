"""A motor speed that the logger repeated makes the whole log a slow one; a speed that the motor held does not."""

import numpy as np
import pytest

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.fits.flow import fit as flow_fit
from estimation.fits.flow.log_traits import LogTraits
from estimation.log_checks.clean import clean_log
from estimation.log_checks.held import without_held_values
from estimation.notes import SensorCode
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, LUMPED, simulate
from plant.errors import LogWarning
from plant.log.record import Record
from plant.sensors.sensors import BENCH, Sensors
from tests.thinned import thinned

SPEED, PRESSURE, POSITION = "motor_speed_rad_s", "differential_pressure_pa", "position_m"
P = EhaParameters()


def log(drive: str = "multisine", seconds: float = 6.0, sensors: Sensors = BENCH) -> Record:
    rng = np.random.default_rng(4)
    return simulate(CIRCUIT, make_drive(drive, seconds, 1e-3, P, rng), 1e-3, P, sensors=sensors, rng=rng)


def held(record: Record, rows: int, *more: str, first: int = 0) -> Record:
    """Return a log whose motor speed comes every ``rows`` rows, and more channels every second row."""
    at = np.arange(len(record))
    taken = np.maximum((at - first) // rows * rows + first, 0)
    return record.replace(**{SPEED: record[SPEED][taken], **{name: record[name][at // 2 * 2] for name in more}})


@pytest.mark.parametrize("first", [0, 3])
@pytest.mark.parametrize("rows", [5, 8])
@pytest.mark.parametrize("drive", ["multisine", "prbs", "steps"])
def test_a_log_is_taken_at_the_samples_of_a_speed_that_was_repeated(drive: str, rows: int, first: int) -> None:
    record = log(drive)
    found, (note,) = without_held_values(held(record, rows, first=first))
    assert (note.code, note.data["channel"], note.data["rows"]) == (SensorCode.SPEED_HELD, SPEED, rows)
    assert found.sample_time == pytest.approx(rows * record.sample_time)
    for name in (SPEED, POSITION, PRESSURE):
        assert np.array_equal(found[name], record[name][first::rows])


def test_other_channels_that_are_held_on_clocks_of_their_own_keep_their_samples() -> None:
    record = log()
    found, notes = without_held_values(held(record, 5, PRESSURE))
    assert [note.code for note in notes] == [SensorCode.SPEED_HELD, SensorCode.HELD]
    there = np.isfinite(found[PRESSURE])
    assert np.mean(there) == pytest.approx(0.5, abs=0.02)
    assert np.array_equal(found[PRESSURE][there], record[PRESSURE][::5][there])


def test_a_motor_that_holds_its_speed_is_believed_row_by_row() -> None:
    at = np.arange(6000)
    stairs = 100.0 * np.sin(2e-2 * (at // 8 * 8)) + 5.0 * np.cos(0.31 * (at // 8 * 8))
    record = simulate(LUMPED, stairs, 1e-3, P, sensors=BENCH, rng=np.random.default_rng(1))
    driven = record.replace(**{SPEED: stairs})
    assert without_held_values(driven) == (driven, ())
    lacking = held(log(), 8).replace(**{PRESSURE: None})  # nothing shows whether the logger or the motor held it
    assert without_held_values(lacking) == (lacking, ())


@pytest.mark.parametrize("drive", thinned(["multisine", "steps"], ["steps"]))
def test_bulk_modulus_comes_back_beside_a_speed_that_was_repeated(drive: str) -> None:
    with pytest.warns(LogWarning, match="log the speed in every row"):
        found = estimate_bulk_modulus(held(log(drive, 8.0), 5), P)
    assert found.gate.passed
    assert found.explanation is None
    assert found.value is not None
    assert found.std is not None
    assert abs(found.value - P.bulk_modulus) < 3.0 * found.std
    assert found.std < 0.02 * P.bulk_modulus


def test_a_log_that_its_slow_speed_leaves_unexplained_is_asked_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("the motor's course between samples is what is not known")

    strange = held(log("steps", 3.0), 5)
    strange = strange.replace(**{PRESSURE: strange[PRESSURE] + 3e5})
    clean = clean_log(strange, P)
    assert clean.speed_held
    monkeypatch.setattr(flow_fit, "explain", never)
    fit = flow_fit.fit_flow(clean.record, P, P.bulk_modulus, {}, clean.variances, LogTraits(speed_held=True))
    assert fit.reasons
    with pytest.raises(AssertionError):
        flow_fit.fit_flow(clean.record, P, P.bulk_modulus, {}, clean.variances)
