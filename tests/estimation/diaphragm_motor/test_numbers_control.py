"""Results of maps and controllers of the diaphragm motor, kept in `numbers_control.json`."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.diaphragm_motor import control
from estimation.diaphragm_motor.control import ControlledRun, VelocityController, controlled_run
from estimation.diaphragm_motor.maps import PRESSURES, SWINGS, MotorMaps, average_run, motor_maps
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import BENCH_SENSORS
from tests.numbers import Numbers, or_refused

NUMBERS = Numbers(__file__)
MOTOR = DiaphragmMotorParameters()


AXES = (np.array([400.0, 480.0]), np.array([0.0, 100.0, 200.0]), np.array([0.0, 2e4, 6e4, 1e5]))


def made_maps() -> MotorMaps:
    f, v, k = np.meshgrid(*AXES, indexing="ij")
    flow = 1e-8 * f / 480.0 * v * (1.0 - k / (600.0 * (v + 1.0)))
    tones = (v / 100.0 * (2.0 - k / 1e5) * (1.0 + 0.1j))[..., None] * np.arange(1.0, 8.0)
    return MotorMaps(MOTOR, *AXES, flow, tones)


@NUMBERS.case()
def maps_between_their_points() -> dict[str, Any]:
    maps = made_maps()
    one = replace(maps, frequencies=AXES[0][:1], flow=maps.flow[:1], tones=maps.tones[:1])
    places = (
        (400.0, 0.0),
        (480.0, 200.0),
        (440.0, 130.0),
        (400.0, 100.0),
        (399.9, 50.0),
        (450.0, 201.0),
        (480.0 + 5e-10, 200.0),
    )
    return {
        "swings and pressures of the grid": [
            len(SWINGS),
            SWINGS[1],
            SWINGS[-1],
            len(PRESSURES),
            PRESSURES[1],
            PRESSURES[-1],
        ],
        "flow [m^3/s]": [or_refused(lambda place=place: maps.row(maps.flow, *place)) for place in places],
        "of one frequency": or_refused(lambda: one.row(one.flow, 400.0, 150.0)),
        "sensed [m^3/s], [Pa]": [maps.sensed(440.0, 130.0, amplitude) for amplitude in (0.5, 6.0, 8.0, 9.5, 12.0)],
        "not rising": replace(maps, tones=np.where(AXES[2][:, None] == 2e4, 3.0 * maps.tones, maps.tones)).sensed(
            400.0, 200.0, 12.0
        ),
    }


@NUMBERS.case()
def the_averaged_motor() -> dict[str, Any]:
    maps = made_maps()
    swing = np.concatenate([np.linspace(0.0, 150.0, 40), np.full(60, 150.0), np.full(50, 20.0)])
    told: dict[str, Any] = {}
    for name, p in {"free": MOTOR, "loaded": replace(MOTOR, load_force=8.0, crossport_leakage=5e-11)}.items():
        pressure, velocity, position = average_run(maps, p, 440.0, swing)
        told[name] = {
            "pressure [Pa]": pressure[[1, 10, 60, 99, 120, 149]],
            "velocity [m/s]": velocity[[1, 10, 60, 99, 120, 149]],
            "position [m]": position[[10, 60, 149]],
        }
    ran = motor_maps(MOTOR, (480.0,), (150.0, 200.0), (0.0, 3e4))
    told["of the plant"] = {"flow [m^3/s]": ran.flow, "tones [V]": np.abs(ran.tones[0, :, :, 3])}
    return told


@NUMBERS.case()
def controllers() -> dict[str, Any]:
    pid = VelocityController(derivative=2.0)
    run = ControlledRun(
        np.arange(1.0, 9.0),
        *(np.full(8, 2.0),) * 2,
        np.array([0.0, 1.0, 2.5, 1.8, 2.05, 2.0, 2.2, 2.0]),
        *(np.ones(8),) * 2,
    )  # type: ignore[arg-type]
    position = np.linspace(0.0, 1e-4, 80) + 1e-6 * np.sin(np.arange(80.0))
    gains = (
        (1e-3, 0.0, 100.0),
        (1e-3, 1e-3, 100.0),
        (-2e-3, 0.0, 5.0),
        (1e-3, 0.0, 400.0),
        (-1e-3, 0.0, 400.0),
        (1e-3, 0.0, -200.0),
        (0.0, 0.0, 350.0),
    )
    return {
        "voltage and integral [V]": [pid.act(*one, 8e-3) for one in gains],
        "by default [V]": VelocityController().act(1e-3, 2e-3, 1.0, 8e-3),
        "settling [s]": [
            run.settling(0.0, 6.0),
            run.settling(3.0, 6.0),
            run.settling(0.0, 8.0, 0.2),
            run.settling(0.0, 7.0),
            run.settling(4.0, 6.0),
            run.settling(0.0, 6.0, 0.01),
        ],
        "speed by an encoder [m/s]": control._encoder_speed(
            position, 20, 8e-3, replace(BENCH_SENSORS, position_m=0.0), np.random.default_rng(1)
        ),  # pyright: ignore[reportPrivateUsage]
    }


@NUMBERS.case(relative=1e-5)
def runs_under_control() -> dict[str, Any]:
    maps = motor_maps(MOTOR, (480.0,), (0.0, 150.0, 300.0), (0.0, 4e4, 8e4))
    schedule = ((0.0, MOTOR), (0.05, replace(MOTOR, load_force=6.0)))
    return {
        sensing: dict(
            vars(
                controlled_run(
                    schedule,
                    lambda t: 3e-3 if t < 0.06 else -2e-3,
                    0.09,
                    480.0,
                    maps,
                    np.random.default_rng(1),
                    sensing=sensing,
                )
            )
        )
        for sensing in ("encoder", "self")
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
