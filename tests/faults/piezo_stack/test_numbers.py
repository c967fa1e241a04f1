"""Effects of faults of the piezo stack, and the size from which each is named, kept in `numbers.json`."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from estimation.piezo_stack.estimate import StackEstimate
from faults.conditions import CONDITIONS
from faults.piezo_stack import diagnose
from faults.piezo_stack.diagnose import CALIBRATED, SELDOM_UNKNOWNS, calibrated_stack, diagnose_stack
from faults.piezo_stack.faults import ADDED_FRICTION, CROSSPORT_LEAKAGE, STACK_FAULTS, stack_with_fault
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import BENCH_SENSORS, simulate_stack, sine_drive
from tests.edges import edge
from tests.numbers import Numbers

NUMBERS = Numbers(__file__)
HEALTHY = PiezoStackParameters(load_mass=10.0)


@NUMBERS.case()
def faults_of_a_stack() -> dict[str, Any]:
    was = asdict(HEALTHY)
    return {
        name: {one: value for one, value in asdict(stack_with_fault(HEALTHY, name)).items() if value != was[one]}
        for name in (*STACK_FAULTS, *CONDITIONS)
    }


def estimate(**of: tuple[float, float]) -> StackEstimate:
    values, deviations = ({name: one[k] for name, one in of.items()} for k in (0, 1))
    return StackEstimate(values, deviations, np.eye(len(of)), {"position_m": 1.0}, 1, HEALTHY, 1000, delay=0.0)


@NUMBERS.case()
def where_faults_are_named() -> dict[str, Any]:
    def named(name: str, value: float, std: float = 0.0) -> Any:
        note = diagnose._fault_note(name, estimate(**{name: (value, std)}), HEALTHY)  # pyright: ignore[reportPrivateUsage]
        return None if note is None else str(note.code)

    def data(name: str, value: float) -> Any:
        note = diagnose._fault_note(name, estimate(**{name: (value, 0.0)}), HEALTHY)  # pyright: ignore[reportPrivateUsage]
        return None if note is None else dict(note.data)

    def level(value: float, std: float = 0.0, name: str = "coulomb_friction") -> Any:
        levels, base = (
            (ADDED_FRICTION, HEALTHY.coulomb_friction)
            if name == "coulomb_friction"
            else (CROSSPORT_LEAKAGE, HEALTHY.crossport_leakage)
        )
        return diagnose._level(estimate(**{name: (value, std)}), name, base, levels)  # pyright: ignore[reportPrivateUsage]

    stiff, gap = HEALTHY.outlet_reed_stiffness, HEALTHY.outlet_reed_gap
    ends = {
        "air_fraction": (HEALTHY.air_fraction, 4.0 * HEALTHY.air_fraction),
        "chamber_leakage": (HEALTHY.chamber_leakage, 1e-11),
        "polarisation": (0.5, 1.0),
        "outlet_reed_stiffness": (stiff, 3.0 * stiff),
        "outlet_reed_gap": (gap, gap + 1e-4),
    }
    return {
        **{name: edge(lambda one, name=name: named(name, one), low, high) for name, (low, high) in ends.items()},
        **{
            f"{name}, its deviation": edge(lambda one, name=name, at=at: named(name, at, one), 0.0, abs(high - low))
            for name, (low, high) in ends.items()
            for at in [low if name == "polarisation" else high]
        },
        "soft reed": edge(lambda one: named("inlet_reed_stiffness", one), 0.1 * stiff, HEALTHY.inlet_reed_stiffness),
        "said": {name: data(name, low if name == "polarisation" else high) for name, (low, high) in ends.items()},
        "minor friction from [N]": edge(level, HEALTHY.coulomb_friction, HEALTHY.coulomb_friction + 100.0),
        "major friction from [N]": edge(level, HEALTHY.coulomb_friction + 100.0, HEALTHY.coulomb_friction + 250.0),
        "minor leakage from": edge(lambda one: level(one, 0.0, "crossport_leakage"), 0.0, 5e-12),
        "major leakage from": edge(lambda one: level(one, 0.0, "crossport_leakage"), 5e-12, 2e-11),
        "friction known to [N]": edge(lambda one: level(0.0, one), 1.0, 99.0),
        "what is calibrated": list(CALIBRATED),
        "tried where all else misses": {names[0]: [dict(one) for one in starts] for names, starts in SELDOM_UNKNOWNS},
    }


@NUMBERS.case(relative=1e-3)
def a_run_that_is_diagnosed() -> dict[str, Any]:
    voltage = sine_drive(275.0, 140.0, 0.012, 1e-4)
    worn = replace(
        HEALTHY, coulomb_friction=HEALTHY.coulomb_friction + 100.0, crossport_leakage=HEALTHY.crossport_leakage + 5e-12
    )
    log = simulate_stack(worn, voltage, 1e-4, sensors=BENCH_SENSORS, rng=np.random.default_rng(5))
    found = diagnose_stack(log, HEALTHY)
    healthy = simulate_stack(
        replace(HEALTHY, viscous_friction=1.1 * HEALTHY.viscous_friction),
        voltage,
        1e-4,
        sensors=BENCH_SENSORS,
        rng=np.random.default_rng(6),
    )
    calibrated = calibrated_stack(healthy, HEALTHY)
    return {
        "condition": found.condition,
        "unknown": found.unknown,
        "outcome": found.outcome.name,
        "faults": [str(one.code) for one in found.faults],
        "reasons": [str(one.code) for one in found.gate.reasons],
        "viscous friction [N s/m]": calibrated.viscous_friction,
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
