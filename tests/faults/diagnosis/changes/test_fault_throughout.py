"""Without pressure, a worn pump is not taken for a change of condition, nor a change for a fault."""

from collections.abc import Iterator
from typing import Any

import pytest

from experiments.open_benchmark.kinds import make
from faults.diagnosis.changes import fault_throughout as subject
from faults.diagnosis.changes.change_odds import BELIEVED_ODDS, gain_of_parts, odds_of_change
from faults.diagnosis.changes.fault_throughout import fault_throughout
from faults.diagnosis.changes.onset import last_part, two_parts
from faults.diagnosis.circuits.class_regions import ClassFits
from plant.log.record import Record
from tests.faults.diagnosis.short_logs import ACTUATOR, blocks, classes

CHANGED = blocks("normal", "major_leakage", pressure=False)


@pytest.fixture(scope="module")
def two() -> Any:
    from faults.diagnosis.circuits.class_regions import fit_classes

    found = two_parts(CHANGED, fit_classes(CHANGED, ACTUATOR), ACTUATOR)
    assert found is not None
    return found


def test_a_worn_pump_is_not_a_change_even_if_two_sound_circuits_beat_one() -> None:
    log = make("worn_pump", "training", 1240).log
    record = Record(1e-3, {name: log[name].to_numpy() for name in ("motor_speed_rad_s", "position_m", "velocity_m_s")})
    assert last_part(record, ACTUATOR).onset is None  # over one sound circuit, two gain 77, and a pump of 80 % gains 52


def test_a_seal_that_fails_within_a_log_is_not_a_fault_throughout(two: Any) -> None:
    assert not fault_throughout(CHANGED, two.parts, two.fits, two.whole, ACTUATOR)


@pytest.mark.parametrize(("beyond", "throughout"), [(1.0, False), (-1.0, True)])
def test_a_change_needs_the_same_odds_against_a_fault_throughout_as_against_no_change(
    two: Any, monkeypatch: pytest.MonkeyPatch, beyond: float, throughout: bool
) -> None:
    """The circuit with a fault explains no more than the sound one; the prior of the fault varies."""
    gain = gain_of_parts(two.whole, two.parts, two.fits)
    odds = odds_of_change(gain, two.fits, two.whole, CHANGED, ACTUATOR)
    asked: list[float] = []

    def one_fault(*args: Any) -> Iterator[tuple[float, ClassFits]]:
        asked.append(args[-1])
        yield odds - beyond - subject.math.log(BELIEVED_ODDS), two.whole

    monkeypatch.setattr(subject, "circuits_with_faults", one_fault)
    assert fault_throughout(CHANGED, two.parts, two.fits, two.whole, ACTUATOR) == throughout
    assert asked == [pytest.approx(odds - subject.math.log(BELIEVED_ODDS))]


def test_with_pressure_no_circuit_with_a_fault_throughout_is_tried(two: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subject, "circuits_with_faults", lambda *_: pytest.fail("asked"))
    assert not fault_throughout(blocks(), two.parts, two.fits, classes(), ACTUATOR)
