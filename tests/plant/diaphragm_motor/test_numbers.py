"""Results of the diaphragm motor's model, plate and runs, kept in `numbers.json`."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from plant.diaphragm_motor.composite_plate import (
    PlateParameters,
    clamped_plate_roots,
    mode_shape,
    plate_coefficients,
    plate_deflection,
    plate_modes,
)
from plant.diaphragm_motor.flow import operate, pump_alone, tone
from plant.diaphragm_motor.model import (
    STATES,
    at_rest,
    deflections,
    motor_derivative,
    motor_row,
    motor_step,
    reassemble_rows,
)
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import (
    BENCH_SENSORS,
    MotorSensors,
    electrode_voltages,
    motor_drive,
    run_schedule,
    simulate_motor,
)
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
PAPER = DiaphragmMotorParameters()
VARIED = DiaphragmMotorParameters(
    spring_stiffness=300.0,
    cubic_stiffness=4e5,
    load_force=2.0,
    hysteresis_exponent=1.3,
    gas_exponent=1.4,
    spool=-1.0,
    valve_leak=tuple(2e-3 * (1.0 + 0.2 * i) for i in range(8)),
    valve_lift=tuple(1.0 - 0.05 * i for i in range(8)),
    polarisation=tuple(1.0 - 0.04 * i for i in range(7)),
    sensor_gain=tuple(1.0 + 0.03 * i for i in range(7)),
    gas_fraction=tuple(1e-3 * (1.0 + 0.3 * i) for i in range(7)),
)
HOLDING = replace(PAPER, spool=0.0)
MOTORS = {"paper's": PAPER, "varied": VARIED, "holding": HOLDING}


def states() -> dict[str, tuple[float, ...]]:
    """Return ordinary states, one near rest, and two beyond an end of the stroke."""
    rng = np.random.default_rng(8)

    def one(size: float, position: float) -> tuple[float, ...]:
        pressures = size * 3e4 * rng.standard_normal(7)
        flows = size * 2e-6 * rng.standard_normal(8)
        openings = rng.uniform(2e-3, 1.0, 8)
        sides = size * np.array([3e4, -8e3])
        return (*pressures, size * 12.0, *flows, *openings, *sides, size * 4e-3, position)

    return {
        "running": one(1.0, 1e-3),
        "near rest": one(1e-3, 0.0),
        "at an end": one(1.0, 0.0251),
        "at the other": one(-2.0, -0.0252),
    }


@NUMBERS.case()
def parameters_of_the_motor_and_its_plate() -> dict[str, Any]:
    return {"motor": asdict(PAPER), "plate": asdict(PlateParameters()), "noise of a bench": asdict(MotorSensors())}


@NUMBERS.case()
def rates_of_the_motor() -> dict[str, Any]:
    return {
        f"{motor}, {name}": dict(zip(STATES, map(float, motor_derivative(state, 3e4, p)), strict=True))
        for motor, p in MOTORS.items()
        for name, state in states().items()
    }


@NUMBERS.case()
def states_after_a_step() -> dict[str, Any]:
    flat = {name: gathered_flat(p) for name, p in MOTORS.items()}
    return {
        f"{motor}, {name}": dict(zip(STATES, map(float, motor_step(state, (20.0, 23.0), p, 2e-5)), strict=True))
        for motor, p in flat.items()
        for name, state in states().items()
    }


def gathered_flat(p: DiaphragmMotorParameters) -> Any:
    """Return the parameters as the kernel reads them, one number for each name."""
    from plant.diaphragm_motor.model import MotorRow

    return MotorRow(*motor_row(p))


@NUMBERS.case()
def rows_rest_and_deflections() -> dict[str, Any]:
    one = np.array([states()["running"], states()["at an end"]])
    return {
        "row": motor_row(VARIED),
        "gathered lift": list(reassemble_rows(gathered_flat(VARIED)).valve_lift),
        "at rest": at_rest(VARIED),
        "deflections [m]": deflections(one, np.array([40.0, -60.0]), VARIED),
    }


@NUMBERS.case()
def plates() -> dict[str, Any]:
    kinds = {
        "motor's": PlateParameters(),
        "thick ceramic": PlateParameters(ceramic_thickness=0.6e-3, ceramic_radius=6e-3, poisson_ratio=0.28),
        "no ceramic": PlateParameters(ceramic_thickness=0.0),
    }
    radii = np.array([0.0, 3e-3, 8e-3, 12.5e-3, 13.4e-3, 14e-3])
    modes = plate_modes(PlateParameters(), 6)
    return {
        "coefficients": {name: plate_coefficients(p)._asdict() for name, p in kinds.items()},
        "deflection [m]": {
            name: [
                plate_deflection(p, pressure, volts, radii)
                for pressure, volts in ((1e4, 0.0), (0.0, 100.0), (-5e3, 80.0))
            ]
            for name, p in kinds.items()
        },
        "thickness [m]": PlateParameters().thickness,
        "roots": [list(mode) for mode in clamped_plate_roots(9)],
        "modes [Hz]": [mode.frequency for mode in modes],
        "shapes": [
            mode_shape(mode, np.array([0.1, 0.35, 0.6, 0.9, 0.5]), np.array([0.0, 0.4, 1.0, 2.0, 3.0]))
            for mode in modes
        ],
    }


@NUMBERS.case()
def runs_of_the_motor() -> dict[str, Any]:
    drive = motor_drive(480.0, 200.0, 0.02, 2e-5)
    places = [3, 400, 700, 1000]
    told: dict[str, Any] = {"drive [V]": drive[places]}
    for name, p in (("paper's", PAPER), ("varied", VARIED)):
        run = simulate_motor(p, drive, 2e-5)
        told[name] = {channel: run[channel][places] for channel in run if channel != "drive_voltage_v"}
    noisy = simulate_motor(PAPER, drive, 2e-5, sensors=BENCH_SENSORS, rng=np.random.default_rng(3))
    told["seen by a bench"] = {channel: noisy[channel][places] for channel in ("electrode_1_v", "position_m")}
    stepped, bent = run_schedule(
        [(0.0, PAPER), (0.008, replace(PAPER, load_force=6.0)), (0.0141, HOLDING)], drive, 2e-5
    )
    told["under a schedule"] = {
        "states": dict(zip(STATES, stepped[places].T, strict=True)),
        "deflections [m]": bent[places],
    }
    return told


@NUMBERS.case()
def settled_motor() -> dict[str, Any]:
    time = 1e-3 * np.arange(100)
    point = operate(pump_alone(PAPER), 480.0, 200.0)
    slow = operate(replace(PAPER, land_conductance=4e-8), 250.0, 150.0, longest_step=2e-5)
    return {
        "pump alone": asdict(point),
        "slow, against its load": asdict(slow),
        "alone": {"spool": pump_alone(PAPER).spool, "land [m^3/(s Pa^0.5)]": pump_alone(PAPER).land_conductance},
        "tone": complex(tone(3.0 * np.cos(2.0 * np.pi * 50.0 * time), 1e-3, 50.0, 2e-3)),
        "voltages of held electrodes [V]": electrode_voltages(np.full((4, 7), 1e-6), VARIED, 1e-3),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
