"""Results of the gear-pump actuator's models, drives and sizing, kept in `numbers.json`."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from plant.compiled.functions import Scalar
from plant.eha.around_mean import break_frequency_about
from plant.eha.circuit import (
    STATES,
    chamber_volumes,
    circuit_breaches,
    circuit_derivative,
    circuit_flows,
    circuit_pressures,
    circuit_scales,
    circuit_step_rate,
    observe_circuit,
)
from plant.eha.circuit_parameters import CircuitParameters, circuit_of, circuit_values, longest_stroke, oil_demand
from plant.eha.circuit_start import at_rest
from plant.eha.cylinder_sizing import BORES_MM, RODS_MM, Duty, buckling_rod, cylinder_circuit, size_cylinder
from plant.eha.doubts import DEFAULT_UNCERTAINTIES, spreads_of
from plant.eha.drives import chirp, make_drive, multisine, nine_steps, prbs, sine
from plant.eha.model import (
    EhaParameters,
    lumped_step,
    piston_areas,
    pressure_rate,
    reduced_derivative,
)
from plant.eha.parameter_path import ParameterPath
from plant.eha.simulate import CIRCUIT, LUMPED, PLANTS, REDUCED, simulate
from plant.eha.steady_state import steady_state
from plant.eha.throttles import ThrottleA, ThrottleB
from plant.sensors.sensors import BENCH
from plant.solvers.steps import parameter_row
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
PAPER = EhaParameters()
SINGLE_ROD = EhaParameters(
    area_difference=0.18,
    volume_difference=-0.1,
    load_force=300.0,
    load_stiffness=2e4,
    pilot_share=0.4,
    stroke=0.2,
    friction_linear=-900.0,
)
WORN = CircuitParameters(
    area_difference=0.18,
    volume_difference=-0.1,
    load_force=-300.0,
    load_stiffness=2e4,
    pilot_share=0.4,
    leakage_coefficient=3e-11,
    cylinder_drain_leakage=4e-12,
    bypass_conductance=3e-12,
    air_fraction=0.004,
    friction_linear=-900.0,
    stroke=0.2,
)


@NUMBERS.case()
def parameters_of_the_papers_tables() -> dict[str, Any]:
    return asdict(CircuitParameters())


@NUMBERS.case()
def how_well_entries_are_known_unless_told() -> dict[str, Any]:
    return {
        "of a catalogue, down and up": {name: list(one.usual) for name, one in DEFAULT_UNCERTAINTIES.items()},
        "measured, down and up": {name: list(one.measured) for name, one in DEFAULT_UNCERTAINTIES.items()},
        "of a rig file": {
            n: list(s) for n, s in spreads_of(DEFAULT_UNCERTAINTIES, {"moving_mass": 0.07}, ["piston_area"]).items()
        },
    }


STATES_TRIED = {
    "forward": (0.01, 0.03, 1.5e6),
    "back": (-0.02, -0.02, -9e5),
    "relieving": (0.0, 0.01, 4.2e6),
    "at rest": (0.0, 0.0, 1e5),
}


@NUMBERS.case()
def rates_and_steps_of_reduced_and_lumped_plants() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for actuator, p in (("paper's", PAPER), ("single rod", SINGLE_ROD)):
        told[actuator] = {
            "areas [m^2]": list(piston_areas(p)),
            "jerk [m/s^3]": [
                reduced_derivative((x, v, a), speed, p)[2]
                for (x, v, _), a, speed in zip(
                    STATES_TRIED.values(), (3.0, -2.0, 0.5, 0.1), (90.0, -70.0, 30.0, 2.0), strict=True
                )
            ],
            "rate of pressure [Pa/s]": [pressure_rate(state[1], state[2], 90.0, p) for state in STATES_TRIED.values()],
            "after 0.2 ms: position, velocity, pressure": {
                name: {
                    unit: [float(lumped_step(state, (speed, speed + 5.0), p, 2e-4)[i]) for speed in (90.0, -80.0, 1.0)]
                    for i, unit in enumerate(("m", "m/s", "Pa"))
                }
                for name, state in STATES_TRIED.items()
            },
        }
    return told


@NUMBERS.case()
def settled_motion() -> dict[str, Any]:
    tight = replace(PAPER, leakage_coefficient=0.0)
    speeds = (-240.0, -60.0, 2.0, 20.0, 125.0, 250.0)
    blocked = replace(PAPER, friction_coulomb=8e3)
    return {
        **{
            f"velocity and pressure, {name} [m/s, Pa]": [list(steady_state(speed, p)) for speed in speeds]
            for name, p in (("paper's", PAPER), ("no leak", tight), ("single rod", SINGLE_ROD), ("blocked", blocked))
        },
        "3 dB about a mean [Hz]": [
            break_frequency_about(speed, p) for p in (PAPER, SINGLE_ROD) for speed in (40.0, 200.0)
        ],
        "rated speed [rad/s]": PAPER.rated_speed,
    }


def state_of(
    motor: float, bristle: float, x: float, v: float, oils: tuple[float, ...], p: CircuitParameters
) -> tuple[Scalar, ...]:
    """Return a state, with the oil in each chamber given as a share of its amount at rest."""
    rest = at_rest(p)
    return motor, bristle, x, v, *(share * held for share, held in zip(oils, rest[4:], strict=True))


CIRCUIT_STATES = {
    "pressed": (100.0, 0.4, 0.002, 0.03, (1.012, 1.002, 0.99)),
    "pulled": (-80.0, -0.7, -0.003, -0.02, (0.995, 1.01, 1.0)),
    "relieving": (150.0, 0.9, 0.0, 0.01, (1.03, 0.999, 0.9)),
    "at the end": (90.0, 0.1, 0.1001, 0.05, (1.07, 0.93, 1.02)),
    "at the other end": (-90.0, -0.1, -0.1001, -0.05, (0.92, 1.08, 1.02)),
    "starved": (60.0, 0.2, 0.0, 0.01, (1.001, 0.97, 0.6)),
    "both starved": (-60.0, 0.2, 0.0, -0.01, (0.98, 0.985, 1.1)),
}


@NUMBERS.case()
def rates_of_the_circuit() -> dict[str, Any]:
    told: dict[str, Any] = {}
    quick = replace(WORN, motor_lag=0.0, accumulator_pressure=4e5)
    for circuit, p in (("sound", CircuitParameters()), ("worn", WORN), ("quick motor", quick)):
        for name, (motor, bristle, x, v, oils) in CIRCUIT_STATES.items():
            state = state_of(motor, bristle, x, v, oils, p)
            rates = circuit_derivative(state, 120.0, p)
            pressures = circuit_pressures(x, state[4:], p)
            volumes = chamber_volumes(x, p)
            told[f"{circuit}, {name}"] = {
                "pressures [Pa]": list(pressures),
                "volumes [m^3]": list(volumes),
                "flows [m^3/s]": list(
                    circuit_flows(motor, (state[4] / volumes[0], state[5] / volumes[1]), pressures, p)
                ),
                **dict(zip((f"rate of {one}" for one in STATES), rates, strict=True)),
            }
    return told


@NUMBERS.case()
def circuit_about_an_actuator() -> dict[str, Any]:
    leaking = replace(PAPER, leakage_coefficient=2e-11, chamber_volume=4e-3, relief_pressure=7e6)
    tight = replace(PAPER, leakage_coefficient=1e-12, bulk_modulus=9e8)
    rows = np.array([parameter_row(p) for p in (CircuitParameters(), WORN)])
    turned = replace(PAPER, area_difference=-0.18, volume_difference=0.1)
    loaded = {"pushed": WORN, "pulled": replace(WORN, load_force=500.0)}
    states = np.array([[0, 0, 0, 0, 1, 1, 1], [0, 0, 0, 0, 0, 1, 1], [0, 0, 0, 0, 1, -1, 0]], dtype=np.float64)
    return {
        "made of a leaking one": asdict(circuit_of(leaking)),
        "made of a tight one": asdict(circuit_of(tight)),
        "leakage inside the cylinder [m^3/(s Pa)]": [p.cylinder_leakage for p in (CircuitParameters(), WORN)],
        "leakage once settled [m^3/(s Pa)]": [p.settled_leakage for p in (CircuitParameters(), WORN)],
        "oil wanted [m^3]": [oil_demand(p) for p in (CircuitParameters(), WORN)],
        "longest stroke [m]": [float(longest_stroke(p)) for p in (PAPER, WORN, turned)],
        "oil at rest [m^3]": {name: [float(one) for one in at_rest(p)[4:]] for name, p in loaded.items()},
        "scales": [circuit_scales(p).tolist() for p in (CircuitParameters(), WORN)],
        "steps a second": circuit_step_rate(circuit_values(rows)),
        "breaches": {reason: broken.tolist() for reason, broken in circuit_breaches(states).items()},
        "observed": {
            name: float(value)
            for name, value in observe_circuit(tuple(at_rest(WORN)), WORN).items()
            if name != "velocity_m_s"
        },
    }


def course(duration: float = 0.06) -> np.ndarray:
    """Return a speed that starts, holds, reverses and returns to rest."""
    time = np.arange(0.0, duration, 1e-3)
    return np.interp(time, [0.0, 0.01, 0.025, 0.035, 0.05, 0.06], [0.0, 120.0, 120.0, -150.0, -150.0, 0.0])


@NUMBERS.case()
def short_runs_of_the_plants() -> dict[str, Any]:
    places = [9, 24, 39, 59]
    told: dict[str, Any] = {}
    for plant in (REDUCED, LUMPED, CIRCUIT):
        for name, p in (("paper's", PAPER), ("single rod", SINGLE_ROD)):
            run = simulate(plant, course(), 1e-3, p)
            told[f"{plant.name}, {name}"] = {channel: run[channel][places] for channel in run}
    growing = ParameterPath((0.0, 0.05), (PAPER, replace(PAPER, leakage_coefficient=5e-11)), "linear")
    told["leakage that grows"] = {
        "pressure [Pa]": simulate(LUMPED, course(), 1e-3, growing)["differential_pressure_pa"][places]
    }
    noisy = simulate(CIRCUIT, course(), 1e-3, PAPER, sensors=BENCH, rng=np.random.default_rng(1), keep_truth=True)
    told["seen by a bench"] = {channel: noisy[channel][places] for channel in noisy}
    told["steps a sample"] = {name: plant.substeps for name, plant in PLANTS.items()}
    stiff = replace(PAPER, friction_quadratic=4e7, moving_mass=0.7)
    told["lumped, stiff"] = {"velocity [m/s]": simulate(LUMPED, course(), 1e-3, stiff)["velocity_m_s"][places]}
    told["circuit, stiff"] = {"velocity [m/s]": simulate(CIRCUIT, course(), 1e-3, stiff)["velocity_m_s"][places]}
    return told


@NUMBERS.case()
def drives_of_the_paper() -> dict[str, Any]:
    places = [0, 1, 7, 60, 150, 399]
    rng = np.random.default_rng
    made = {
        "sine": sine(0.4, 1e-3, 100.0),
        "chirp": chirp(0.4, 1e-3, 100.0),
        "binary": prbs(0.4, 1e-3, 100.0, 0.05, rng(2)),
        "binary, cut short": prbs(0.4, 1e-3, 100.0, 0.0304, rng(3)),
        "steps": nine_steps(0.4, 1e-3, PAPER, rng(4)),
        "multisine": multisine(0.4, 1e-3, 100.0, rng(5)),
        "multisine in a band": multisine(0.4, 1e-3, 100.0, rng(6), 2.0, 40.0, 0.4),
    }
    named = {
        name: make_drive(name, 0.4, 1e-3, PAPER, rng(7)) for name in ("sine", "prbs", "steps", "chirp", "multisine")
    }
    return {
        **{f"{name} [rad/s]": one[places] for name, one in made.items()},
        **{f"{name} at 4 V [rad/s]": one[places] for name, one in named.items()},
        "switches of a binary signal": [
            int(np.count_nonzero(np.diff(made[name]))) for name in ("binary", "binary, cut short")
        ],
    }


@NUMBERS.case()
def parameters_along_a_path() -> dict[str, Any]:
    sets = PAPER, replace(PAPER, bulk_modulus=1e8), replace(PAPER, bulk_modulus=3e8)
    times = [-1.0, 0.0, 0.5, 1.0, 2.0, 5.0, 9.0]
    return {
        growth: ParameterPath((0.0, 1.0, 5.0), sets, growth).sample(times)[:, 4].tolist()  # pyright: ignore[reportArgumentType]
        for growth in ("step", "linear")
    } | {
        "nothing changes": ParameterPath.constant(PAPER).is_constant,
        "something does": ParameterPath((0.0, 1.0, 5.0), sets).is_constant,
    }


@NUMBERS.case()
def throttles() -> dict[str, Any]:
    a = ThrottleA((10.0, 6.0, 4.0, 3.0), (5e-12, 2e-11, 6e-11, 9e-11), (2e-6, 5e-6, 9e-6, 1.4e-5))
    b = ThrottleB((10.0, 6.0, 4.0), (1e-6, 4e-6, 3e-5))
    volts = (0.0, 2.0, 3.5, 5.0, 8.0, 10.0)
    return {
        "leakage of A [m^3/(s Pa)]": [a.at(one)[0] for one in volts],
        "bias of A [m^3/s]": [a.at(one)[1] for one in volts],
        "area of B [m^2]": [b.at(one) for one in volts],
    }


DUTIES = {
    "press": {"extend_force": 10e3, "extend_speed": 0.1, "stroke": 0.5, "supply_pressure": 100e5},
    "puller": {
        "extend_force": 2e3,
        "extend_speed": 0.05,
        "stroke": 0.2,
        "supply_pressure": 60e5,
        "retract_force": 9e3,
        "retract_speed": 0.2,
    },
    "small": {
        "extend_force": 40.0,
        "extend_speed": 4.2e-3,
        "stroke": 0.03,
        "supply_pressure": 1.6e5,
        "return_pressure": 1e4,
    },
    "long": {"extend_force": 5e3, "extend_speed": 0.3, "stroke": 1.8, "supply_pressure": 120e5, "efficiency": 0.8},
    "large": {"extend_force": 1.2e6, "extend_speed": 0.02, "stroke": 0.6, "supply_pressure": 200e5},
}


@NUMBERS.case()
def sizes_of_cylinders() -> dict[str, Any]:
    sized = {f"smallest for a {name}": asdict(size_cylinder(Duty(**duty))) for name, duty in DUTIES.items()}
    return sized | {
        "standard bores and rods of ISO 3320 [mm]": [BORES_MM, RODS_MM],
        "usual": asdict(Duty(**DUTIES["press"])),
        "of given diameters": asdict(cylinder_circuit(Duty(**DUTIES["puller"]), 0.05, 0.036)),
        "rod that does not buckle [m]": [buckling_rod(force, stroke) for force, stroke in ((1e4, 0.5), (3e3, 0.2))],
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
