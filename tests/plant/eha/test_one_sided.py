"""A circuit with unequal make-up valves is the usual circuit if nothing is wrong, and each side shows its own fault."""

from dataclasses import replace

import numpy as np
import pytest

from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.one_sided import (
    ONE_SIDED,
    OneSidedParameters,
    circuit_plant,
    one_sided_derivative,
    padded_row,
    with_make_up_faults,
)
from plant.eha.simulate import CIRCUIT, simulate
from plant.errors import RigError
from plant.log.record import Record
from plant.solvers.steps import parameter_row

PAPER = CircuitParameters()
DRIVE = np.repeat([110.0, -110.0, 90.0, -90.0], 250)


def run(sign: float = 1.0, /, **faults: float) -> Record:
    return simulate(ONE_SIDED, sign * DRIVE, 2e-3, with_make_up_faults(PAPER, **faults))


def lowest(record: Record) -> tuple[float, float]:
    return float(np.min(record["pressure_a_pa"])), float(np.min(record["pressure_b_pa"]))


def test_a_one_sided_circuit_without_faults_equals_the_circuit() -> None:
    plain = simulate(CIRCUIT, DRIVE, 2e-3, PAPER)
    same = run()
    for name in plain:
        assert same[name] == pytest.approx(plain[name], rel=1e-9, abs=1e-9 * float(np.max(np.abs(plain[name]))))


@pytest.mark.parametrize(("side", "low", "sign"), [("a", 0, -1.0), ("b", 1, 1.0)])
def test_a_chamber_whose_valve_is_stuck_shut_draws_no_oil_and_its_pressure_falls(
    side: str, low: int, sign: float
) -> None:
    sound, stuck = (lowest(run(sign, **fault))[low] for fault in ({}, {f"makeup_shut_{side}": 1.0}))
    assert sound > 0.7 * PAPER.accumulator_pressure
    assert stuck < 0.3 * PAPER.accumulator_pressure
    # here the pump fills the chamber first
    assert lowest(run(-sign, **{f"makeup_shut_{side}": 1.0}))[low] > 0.9 * PAPER.accumulator_pressure


@pytest.mark.parametrize(("side", "sign"), [("a", 1.0), ("b", -1.0)])
def test_a_leaking_seat_slows_the_piston_while_its_chamber_pushes(side: str, sign: float) -> None:
    sound, leaking = run(), run(**{f"seat_leakage_{side}": 1e-10})
    pushing = np.sign(DRIVE) == sign
    lost = [
        1.0 - np.sum(np.abs(leaking["velocity_m_s"][there])) / np.sum(np.abs(sound["velocity_m_s"][there]))
        for there in (pushing, ~pushing)
    ]
    assert lost[0] > 0.1
    assert lost[0] > 2.0 * abs(lost[1])


@pytest.mark.parametrize("name", ["makeup_shut_a", "makeup_shut_b", "seat_leakage_a", "seat_leakage_b"])
def test_the_oil_that_a_faulty_valve_passes_leaves_the_inner_circuit(name: str) -> None:
    size = 1.0 if name.startswith("makeup") else 1e-10
    state = (0.0, 0.0, 0.0, 0.0, 2.1605e-3, 2.161e-3, PAPER.accumulator_oil)  # both chambers are below it
    sound, faulty = (
        np.array(one_sided_derivative(state, 0.0, with_make_up_faults(PAPER, **fault))) for fault in ({}, {name: size})
    )
    more = faulty - sound
    assert np.flatnonzero(more).tolist() == [4 + "ab".index(name[-1]), 6]
    assert (more.max() > 0.0, more.sum()) == (True, pytest.approx(0.0, abs=1e-9 * more.max()))


def test_the_length_of_a_row_selects_the_circuit_and_a_widened_row_has_no_faults() -> None:
    short, long = parameter_row(PAPER), parameter_row(with_make_up_faults(PAPER))
    assert circuit_plant(len(short)) is CIRCUIT
    assert circuit_plant(len(long)) is ONE_SIDED
    assert padded_row(short, len(long)).tolist() == long.tolist()
    assert padded_row(short, len(short)).tolist() == short.tolist()


def test_the_shut_share_of_a_valve_is_at_most_one() -> None:
    assert with_make_up_faults(PAPER, makeup_shut_a=1.0).makeup_shut_a == 1.0
    with pytest.raises(RigError, match="makeup_shut_b must be at most 1"):
        replace(OneSidedParameters(), makeup_shut_b=1.2)
