"""Severities that a log does not determine."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.finding import Quantity
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import WEAK_PRIOR
from faults.diagnosis.not_told import not_told_notes, standstill_notes, without_undetermined
from faults.diagnosis.severity import severities
from faults.notes import AgainstCode, ClassCode
from plant.eha.steady_state import steady_state
from plant.log.record import Record
from tests.faults.diagnosis.test_severity import ACTUATOR, NARROW, RIG, fits


def not_told(spread: np.ndarray, condition: str = "normal", *, pressure: bool = True) -> set[str]:
    found = fits(spread, list(CONDITIONS).index(condition))
    return {note.code.name for note in not_told_notes(found, severities(found, ACTUATOR), pressure=pressure)}


FRICTION = ("friction_rest", "friction_quadratic", "friction_rated")


def blind(*names: str) -> np.ndarray:
    """Return a covariance that is the prior's in some coordinates and narrow in all others."""
    sizes = np.array([WEAK_PRIOR[i, i] * 50.0 if name in names else 1e-4 for i, name in enumerate(COORDINATES)])
    return np.diag(sizes)


def test_coordinates_that_a_log_does_not_narrow_are_noted_as_not_visible() -> None:
    assert not_told(NARROW) == set()
    assert not_told(blind("bulk_modulus")) == {ClassCode.BULK_MODULUS_NOT_VISIBLE.name}
    assert ClassCode.FRICTION_NOT_VISIBLE.name in not_told(blind(*FRICTION))
    assert ClassCode.FRICTION_NOT_VISIBLE.name not in not_told(blind("friction_rest"))


def test_inseparable_leakage_and_bias_still_determine_the_velocity_lost() -> None:
    one, two = (COORDINATES.index(name) for name in ("leakage", "bias"))
    leaking = parameters_for(CONDITIONS["minor_leakage"])
    assert ACTUATOR.conditions[list(CONDITIONS).index("minor_leakage")][one] == np.log(leaking.leakage_coefficient)
    apart = np.zeros(7)
    apart[one] = leaking.flow_bias
    apart[two] = -leaking.leakage_coefficient * steady_state(RIG.rated_speed, leaking)[1]
    traded = 1e-3 * NARROW + 0.6**2 * np.outer(apart, apart) / (apart @ apart)
    assert not_told(traded, "minor_leakage") == {
        ClassCode.LEAKAGE_AND_BIAS_ALIKE.name,
        ClassCode.VELOCITY_LOST_TOLD.name,
    }


def test_without_pressure_one_scale_is_always_noted_as_undetermined() -> None:
    assert not_told(NARROW, pressure=False) == {ClassCode.ONE_SCALE.name, ClassCode.VELOCITY_LOST_TOLD.name}


@pytest.mark.parametrize(
    ("said", "travel", "doubted"),
    [
        ((ClassCode.ONE_SCALE, ClassCode.FRICTION_NOT_VISIBLE), 1e-5, True),
        ((ClassCode.ONE_SCALE, ClassCode.FRICTION_NOT_VISIBLE), 5e-3, False),
        ((ClassCode.ONE_SCALE,), 1e-5, False),
    ],
)
def test_a_piston_that_does_not_move_for_an_unknown_reason_has_no_condition(
    said: tuple[ClassCode, ...], travel: float, doubted: bool
) -> None:
    time = 1e-3 * np.arange(2000)
    turning = {"motor_speed_rad_s": 100.0 * np.sign(np.sin(3.0 * time)), "position_m": travel * np.sin(3.0 * time)}
    found = standstill_notes(Record(1e-3, turning), RIG, [code.note() for code in said])
    assert [note.code for note in found] == ([AgainstCode.STUCK_OR_LEAKS] if doubted else [])


@pytest.mark.parametrize(("pressure", "reason"), [(None, AgainstCode.STUCK_OR_LEAKS), (3e6, AgainstCode.ROD_BLOCKED)])
def test_without_position_velocity_shows_that_a_piston_does_not_move(
    pressure: float | None, reason: AgainstCode
) -> None:
    """Velocity noise hides friction; a circuit had 50 times the friction, or leakage and friction were inseparable."""
    time = 1e-3 * np.arange(2000)
    sign, noise = np.sign(np.sin(3.0 * time)), 1e-3 * np.random.default_rng(2).standard_normal(2000)
    record = Record(1e-3, {"motor_speed_rad_s": 100.0 * sign, "velocity_m_s": noise})
    if pressure is not None:
        record = record.replace(differential_pressure_pa=pressure * sign)
    said = [ClassCode.ONE_SCALE.note()] if pressure is None else []
    assert [note.code for note in standstill_notes(record, RIG, said)] == [reason]
    moving = record.replace(velocity_m_s=noise + 0.01 * np.sin(3.0 * time))
    assert standstill_notes(moving, RIG, said) == ()


@pytest.mark.parametrize(("pressure", "travel", "blocked"), [(3e6, 1e-5, True), (3e5, 1e-5, False), (3e6, 5e-3, False)])
def test_a_piston_held_against_a_pressure_beyond_the_friction_of_the_nine_is_blocked(
    pressure: float, travel: float, blocked: bool
) -> None:
    time = 1e-3 * np.arange(2000)
    sign = np.sign(np.sin(3.0 * time))
    turning = {"motor_speed_rad_s": 100.0 * sign, "position_m": travel * np.sin(3.0 * time)}
    record = Record(1e-3, {**turning, "differential_pressure_pa": pressure * sign})
    found = standstill_notes(record, RIG, [ClassCode.FRICTION_NOT_VISIBLE.note()])
    assert [note.code for note in found] == ([AgainstCode.ROD_BLOCKED] if blocked else [])


def test_a_velocity_lost_without_a_number_or_an_interval_is_not_noted() -> None:
    found = fits(NARROW)
    known = severities(found, ACTUATOR)
    for lost in (Quantity(None, "%"), replace(known["velocity_lost"], ci95=None)):
        said = not_told_notes(found, {**known, "velocity_lost": lost}, pressure=False)
        assert [note.code for note in said] == [ClassCode.ONE_SCALE]


def test_the_velocity_lost_is_noted_with_its_interval() -> None:
    found = fits(NARROW)
    known = severities(found, ACTUATOR)
    (said,) = (
        note for note in not_told_notes(found, known, pressure=False) if note.code is ClassCode.VELOCITY_LOST_TOLD
    )
    lost = known["velocity_lost"]
    assert lost.ci95 is not None
    assert (said.data["percent"], said.data["low"], said.data["high"]) == (lost.value, *lost.ci95)


def test_a_severity_that_the_log_does_not_narrow_has_no_number() -> None:
    known = severities(fits(NARROW), ACTUATOR)
    told = without_undetermined(known, [ClassCode.BULK_MODULUS_NOT_VISIBLE])
    assert told["bulk_modulus"] == Quantity(None, "Pa")
    assert {name for name in known if told[name] != known[name]} == {"bulk_modulus", "entrained_air"}
    assert without_undetermined(known, [ClassCode.ONE_SCALE]) == known
