"""A rig file that takes sides A and B of a single rod for each other is named, and a right one is not."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.swapped_sides import SidesCode
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.drives import nine_steps
from plant.eha.model import PARAMETER_NAMES, EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

ROD = CircuitParameters(area_difference=0.2, volume_difference=0.2, pilot_share=1.0, accumulator_gas=0.01)
CHANNELS = ("motor_speed_rad_s", "position_m", "differential_pressure_pa")


def log_of(rig: CircuitParameters) -> Record:
    true, rng = parameters_for(CONDITIONS["minor_leakage"], rig), np.random.default_rng(463)
    speed = nine_steps(1.4, 1e-3, rig, rng)
    record = simulate(CIRCUIT, speed, 1e-3, true, sensors=BENCH, rng=rng)
    return Record(1e-3, {name: record[name] for name in CHANNELS})


def file_of(rig: EhaParameters) -> EhaParameters:
    return EhaParameters(**{name: getattr(rig, name) for name in PARAMETER_NAMES})


@pytest.mark.parametrize("swapped", [True, False])
def test_swapped_sides_are_named(*, swapped: bool) -> None:
    sign = -1.0 if swapped else 1.0
    rig = replace(file_of(ROD), area_difference=sign * 0.2, volume_difference=sign * 0.2)
    fit = fit_flow(log_of(ROD), rig, rig.bulk_modulus)
    assert (SidesCode.SIDES_SWAPPED in [note.code for note in fit.reasons]) == swapped
