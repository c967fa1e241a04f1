"""A single rod exchanges oil with the inner circuit's accumulator, whose gas volume no rig file states."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from faults.diagnosis.beyond_nine.accumulator import fit_accumulator, with_fitted_accumulator
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.actuator import Actuator, actuator_of
from faults.diagnosis.circuits.blocks import Blocks, blocks_of
from faults.diagnosis.circuits.class_regions import ClassFits, fit_classes
from faults.diagnosis.circuits.out_of_model import unexplained_notes
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import chirp
from plant.eha.simulate import CIRCUIT, simulate
from plant.sensors.sensors import BENCH
from tests.estimation.fits.flow.test_model_steps import PILOTED, SPEED
from tests.faults.diagnosis.short_logs import ACTUATOR, blocks, classes

LITTLE = replace(circuit_of(PILOTED), accumulator_gas=1.5e-4, accumulator_oil=1.5e-4, leakage_coefficient=6.86e-11)


@cache
def of_rod() -> tuple[Blocks, Actuator, ClassFits]:
    """Return a log of a single rod with a small gas volume, and circuits fitted with a gas volume of one litre."""
    actuator = actuator_of(replace(LITTLE, accumulator_gas=1e-3, accumulator_oil=1e-3))
    speed = chirp(2.5, 5e-4, SPEED, 0.3, 1.0)
    record = simulate(CIRCUIT, speed, 5e-4, LITTLE, sensors=BENCH, rng=np.random.default_rng(1))
    log = blocks_of(record)
    return log, actuator, fit_classes(log, actuator)


def test_the_gas_volume_of_a_single_rods_accumulator_is_estimated_from_its_log() -> None:
    log, actuator, fits = of_rod()
    assert unexplained_notes(log, fits, actuator)
    fed = fit_accumulator(log, fits, actuator)
    assert fed is not None
    assert fed.accumulator_gas == pytest.approx(LITTLE.accumulator_gas, rel=0.1)
    assert replace(fed, accumulator_gas=1e-3) == actuator.circuit
    assert fit_accumulator(replace(log, pressure=None), fits, actuator) is None


def test_no_other_gas_volume_is_proposed_for_a_log_that_the_rig_file_explains() -> None:
    assert fit_accumulator(blocks(), classes(), ACTUATOR) is None


def test_the_gas_volume_is_refitted_only_for_an_unexplained_log_of_a_single_rod() -> None:
    log, actuator, fits = of_rod()
    left = tuple(unexplained_notes(log, fits, actuator))
    board: Any = SimpleNamespace(blocks=log, fits=fits)

    def found(against: tuple[Any, ...], parameters: Any) -> Any:
        return SimpleNamespace(diagnosis=Diagnosis({}, against, {}, {}, {}, (), board), parameters=parameters)

    def again(parameters: Any) -> Any:
        assert parameters.accumulator_gas < 1e-3
        return found((), parameters)

    followed, alike, asked = found((), actuator.circuit), found(left, ACTUATOR.circuit), found(left, actuator.circuit)
    assert with_fitted_accumulator(followed, again) is followed
    assert with_fitted_accumulator(alike, again) is alike
    assert with_fitted_accumulator(asked, again).diagnosis.against == ()
    assert with_fitted_accumulator(asked, lambda _: found(left, actuator.circuit)) is asked
