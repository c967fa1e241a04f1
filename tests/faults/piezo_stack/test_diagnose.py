"""Classes and findings from logs of the piezo-stack actuator."""

from dataclasses import replace

import numpy as np
import pytest

from faults.conditions import CONDITIONS
from faults.piezo_stack.diagnose import StackAdviceCode, calibrated_stack, diagnose_stack
from faults.piezo_stack.faults import stack_in_condition, stack_with_fault
from plant.log.record import Record
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import BENCH_SENSORS, simulate_stack, sine_drive

HEALTHY = PiezoStackParameters(load_mass=10.0)
OTHER = replace(
    HEALTHY,
    delivery_length=1.05 * HEALTHY.delivery_length,
    return_length=1.05 * HEALTHY.return_length,
    intake_length=1.05 * HEALTHY.intake_length,
    outlet_reed_stiffness=0.95 * HEALTHY.outlet_reed_stiffness,
    inlet_reed_stiffness=0.95 * HEALTHY.inlet_reed_stiffness,
    discharge_coefficient=1.03 * HEALTHY.discharge_coefficient,
)
SAMPLE_TIME = 5e-5
DRIVE = sine_drive(275.0, 140.0, 0.05, SAMPLE_TIME)


def log_of(p: PiezoStackParameters, seed: int = 1) -> Record:
    return simulate_stack(p, DRIVE, SAMPLE_TIME, sensors=BENCH_SENSORS, rng=np.random.default_rng(seed))


def test_a_condition_is_named_with_advice() -> None:
    name = "major_leakage_minor_friction"
    found = diagnose_stack(log_of(stack_in_condition(HEALTHY, name)), HEALTHY)
    assert (found.condition, found.faults, found.gate.reasons) == (name, (), ())
    assert [str(note) for note in found.advice] == [
        "inspect the seal of the cylinder's piston",
        "inspect the rod seals, the guide and its alignment",
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "said", "code"),
    [
        ("air_doubled", "2 times the healthy share", StackAdviceCode.BLEED_OIL),
        ("chamber_leakage_minor", "the pump chamber leaks: 0.03 L/(min bar)", StackAdviceCode.LOOK_AT_CHAMBER),
        ("depolarised_10_percent", "10 % of its stroke is lost", StackAdviceCode.POLARISE),
        ("inlet_reed_soft", "inlet reed soft: 0.5", StackAdviceCode.REPLACE_REED),
        ("inlet_reed_gap", "inlet reed does not shut: a gap of 30 um", StackAdviceCode.CLEAN_SEAT),
        ("inlet_reed_jammed", "inlet reed stiff or jammed", StackAdviceCode.FREE_REED),
        ("bias_lost", "bias pressure 0.6 MPa where the rig file says 1 MPa", StackAdviceCode.SET_BIAS),
    ],
)
def test_every_other_fault_is_named_with_its_size(fault: str, said: str, code: StackAdviceCode) -> None:
    found = diagnose_stack(log_of(stack_with_fault(HEALTHY, fault)), HEALTHY)
    assert found.condition == "normal"
    (note,) = found.faults
    assert said in str(note)
    (advice,) = found.advice
    assert advice.code is code


@pytest.mark.slow
def test_another_actuator_has_objections_and_is_diagnosed_after_calibration() -> None:
    assert diagnose_stack(log_of(OTHER), HEALTHY).gate.reasons
    calibrated = calibrated_stack(log_of(OTHER), HEALTHY)
    assert calibrated.delivery_length == pytest.approx(OTHER.delivery_length, rel=0.01)
    for name in list(CONDITIONS)[::4]:
        found = diagnose_stack(log_of(stack_in_condition(OTHER, name), 2), calibrated)
        assert (found.condition, found.gate.reasons) == (name, ())


def test_a_drive_logged_too_small_is_named_as_a_stroke_beyond_the_rig_file() -> None:
    log = log_of(HEALTHY)
    found = diagnose_stack(log.replace(drive_voltage_v=0.93 * log["drive_voltage_v"]), HEALTHY)
    (fault,), (advice,) = found.faults, found.advice
    assert str(fault) == "the stack moves 8 % more than the rig file says"
    assert advice.code is StackAdviceCode.CHECK_SCALE


@pytest.mark.slow
def test_a_single_disagreeing_channel_is_named_without_a_fault() -> None:
    log = log_of(HEALTHY)
    for name in ("stack_displacement_m", "stack_force_n"):
        found = diagnose_stack(log.replace(**{name: 1.05 * log[name]}), HEALTHY)
        assert found.unknown
        assert str(found.against[-1]).startswith(f"{name} alone disagrees")
        assert found.faults == ()
    heavy = diagnose_stack(log_of(replace(HEALTHY, load_mass=HEALTHY.load_mass + 20.0)), HEALTHY)
    assert heavy.unknown
    assert not any("alone disagrees" in str(note) for note in heavy.against)


@pytest.mark.parametrize("late", ["channels", pytest.param("drive", marks=pytest.mark.slow)])
def test_a_log_whose_channels_or_drive_are_late_is_diagnosed_in_step(late: str) -> None:
    name = "minor_leakage_minor_friction"
    log = log_of(stack_in_condition(HEALTHY, name))
    time = SAMPLE_TIME * np.arange(len(log))
    moved = [one for one in log if (one == "drive_voltage_v") is (late == "drive")]
    found = diagnose_stack(log.replace(**{one: np.interp(time - 1e-4, time, log[one]) for one in moved}), HEALTHY)
    assert (found.condition, found.faults, found.gate.reasons) == (name, (), ())
    (note,) = found.notes
    assert dict(note.data) == {
        "shift_us": pytest.approx(100.0, abs=4.0),
        "side": "behind" if late == "channels" else "ahead of",
    }


@pytest.mark.slow
def test_a_single_late_channel_is_named_and_no_delay_of_all_is_corrected() -> None:
    log = log_of(HEALTHY)
    time = SAMPLE_TIME * np.arange(len(log))
    found = diagnose_stack(
        log.replace(chamber_pressure_pa=np.interp(time - 1e-4, time, log["chamber_pressure_pa"])), HEALTHY
    )
    assert str(found.against[-1]).startswith("chamber_pressure_pa alone disagrees")
    assert found.notes == ()
