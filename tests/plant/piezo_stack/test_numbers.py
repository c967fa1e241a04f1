"""Results of the piezo-stack actuator's model and runs, kept in `numbers.json`."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from plant.piezo_stack.flow import line_reynolds_numbers, mean_flow, output_flow, stages
from plant.piezo_stack.free import loop_width, run_free_stack, stack_loop
from plant.piezo_stack.model import STATES, at_bias, stack_derivative, stack_pressures, volumes
from plant.piezo_stack.parameters import PiezoStackParameters, least_port
from plant.piezo_stack.run import BENCH_SENSORS, StackSensors, simulate_stack, sine_drive
from plant.piezo_stack.trajectory import run_stack, run_stacks
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
PAPER = PiezoStackParameters()
VARIED = replace(
    PAPER,
    load_mass=12.0,
    chamber_leakage=3e-11,
    crossport_leakage=2e-11,
    air_fraction=0.002,
    accumulator_gas=1e-5,
    bias_pressure=6e5,
)
SHUT = replace(PAPER, accumulator_gas=0.0)
STACKS = {"paper's": PAPER, "varied": VARIED, "accumulator shut": SHUT}


def states(p: PiezoStackParameters) -> dict[str, tuple[float, ...]]:
    """Return states far from rest: pumping, drawing in, reeds at both ends of their travel, a rod at its stops."""
    rest = at_bias(p, 40.0)
    oil = np.ones(len(rest))

    def moved(shares: dict[int, float], **values: float) -> tuple[float, ...]:
        state = rest * np.array([shares.get(i, 1.0) for i in range(len(oil))])
        for name, value in values.items():
            state[STATES.index(name)] = value
        return tuple(map(float, state))

    flows = {"delivery_flow_m3_s": 2e-5, "return_flow_m3_s": 1e-5, "intake_flow_m3_s": 1.5e-5}
    back = {name: -0.7 * flow for name, flow in flows.items()}
    return {
        "pumping": moved(
            {4: 1.002, 9: 1.001, 11: 1.0003, 14: 0.9998, 16: 1.1, 18: 0.9997},
            stack_displacement_m=1.1e-5,
            stack_velocity_m_s=0.02,
            hysteresis_m=2e-6,
            outlet_reed_m=8e-5,
            outlet_reed_velocity_m_s=0.1,
            inlet_reed_m=-2e-6,
            inlet_reed_velocity_m_s=-0.05,
            velocity_m_s=0.03,
            position_m=0.004,
            **flows,
        ),
        "taking in": moved(
            {4: 0.9993, 9: 0.9999, 11: 1.0006, 14: 1.0002, 16: 0.95, 18: 1.0004},
            stack_displacement_m=4e-6,
            stack_velocity_m_s=-0.02,
            hysteresis_m=-1e-6,
            outlet_reed_m=-1e-6,
            outlet_reed_velocity_m_s=-0.02,
            inlet_reed_m=3e-4,
            inlet_reed_velocity_m_s=0.2,
            velocity_m_s=-0.02,
            **back,
        ),
        "at its upper stop": moved({11: 1.001}, position_m=0.1475, velocity_m_s=0.01, outlet_reed_m=6e-4),
        "at its lower stop": moved({14: 1.001}, position_m=-0.1476, velocity_m_s=-0.01, inlet_reed_m=6e-4),
    }


@NUMBERS.case()
def parameters_of_the_stack() -> dict[str, Any]:
    return {"actuator": asdict(PAPER), "noise of a bench": asdict(StackSensors())}


@NUMBERS.case()
def rates_of_the_stack() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for stack, p in STACKS.items():
        for name, state in states(p).items():
            told[f"{stack}, {name}"] = {
                "volumes [m^3]": list(volumes(state[0], state[12], p)),
                "pressures [Pa]": stack_pressures(state, p)._asdict(),
                **dict(
                    zip(
                        (f"rate of {one}" for one in STATES),
                        map(float, stack_derivative(state, 60.0, -2e4, p)),
                        strict=True,
                    )
                ),
            }
    return told


@NUMBERS.case()
def rest_and_limits() -> dict[str, Any]:
    return {
        "at bias": {name: dict(zip(STATES, at_bias(p, 40.0), strict=True)) for name, p in STACKS.items()},
        "least port [m^3]": [least_port(p) for p in (PAPER, replace(PAPER, density=900.0))],
        "moved mass [kg]": [PAPER.moving_mass, VARIED.moving_mass],
        "mean flow [m^3/s]": mean_flow(
            1e-3 * np.sin(0.02 * np.arange(1001)) + 5e-6 * np.arange(1001), 1e-4, 130.0, 4e-4
        ),
    }


@NUMBERS.case()
def runs_of_the_stack() -> dict[str, Any]:
    drive = sine_drive(275.0, 140.0, 0.012, 2e-5)
    places = [20, 260, 430, 600]
    told: dict[str, Any] = {
        "drive [V]": drive[places],
        "on a bias [V]": sine_drive(90.0, 60.0, 0.01, 1e-4, 80.0)[[0, 30, 77]],
    }
    for name, p in STACKS.items():
        seen = run_stack(p, drive, 2e-5)
        told[name] = dict(zip(STATES, seen[places].T, strict=True))
        told[f"stages of {name}"] = [int(np.count_nonzero(stages(seen, p) == stage)) for stage in range(4)]
        told[f"Reynolds number in {name}"] = line_reynolds_numbers(seen, p)[places]
    told["two side by side"] = [one[places, 12] for one in run_stacks([PAPER, VARIED, SHUT], drive, 2e-5)]
    noisy = simulate_stack(VARIED, drive, 2e-5, sensors=BENCH_SENSORS, rng=np.random.default_rng(3))
    told["seen by a bench"] = {channel: noisy[channel][places] for channel in noisy}
    told["flow on a sine [m^3/s]"] = output_flow(VARIED, 275.0, 140.0)
    return told


@NUMBERS.case()
def stack_alone() -> dict[str, Any]:
    voltage, displacement = stack_loop(PAPER, 20.0, 100.0, 100)
    places = [0, 20, 50, 77, 100]
    return {
        "stepped [m]": run_free_stack(PAPER, np.concatenate([np.full(3, 20.0), np.full(60, 50.0)]), 1e-5)[
            [0, 4, 20, 62]
        ],
        "loop [m]": displacement[places],
        "width over stroke": loop_width(voltage, displacement),
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
