"""The pressure under which a piston slides distinguishes a wrong unit of pressure from other oil."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED
from estimation.log_checks.sliding_pressure import LEAST, MOST, sliding_excess, sliding_pressure
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

RIG = EhaParameters()


@pytest.mark.parametrize("condition", ["normal", "major_leakage", "major_friction"])
@pytest.mark.parametrize("drive", ["steps", "multisine"])
def test_pistons_in_all_conditions_slide_at_the_pressure_of_their_friction(condition: str, drive: str) -> None:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(3)
    log = simulate(CIRCUIT, make_drive(drive, 4.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    ratio = sliding_pressure(log, RIG)
    assert LEAST < ratio < MOST
    assert sliding_excess(ratio) == 0.0
    assert sliding_excess(0.1 * ratio) < 0.0


def test_a_still_piston_has_a_neutral_ratio_of_sliding_pressure() -> None:
    still = {SPEED: np.ones(500), POSITION: np.zeros(500), PRESSURE: np.linspace(0.0, 1e5, 500)}
    assert sliding_pressure(Record(1e-3, still), RIG) == 1.0


def test_a_rig_without_friction_has_a_neutral_ratio_of_sliding_pressure() -> None:
    slides = {SPEED: np.ones(500), POSITION: np.linspace(0.0, 0.01, 500), PRESSURE: np.full(500, 1e5)}
    smooth = replace(RIG, friction_coulomb=0.0, friction_linear=0.0, friction_quadratic=0.0)
    assert sliding_pressure(Record(1e-3, slides), smooth) == 1.0


def test_viscous_friction_counts_in_the_sliding_pressure() -> None:
    """Over Coulomb friction alone, pressure was 10 times too high, so oil 4 times as stiff made its unit seem wrong."""
    rig, rng = replace(RIG, friction_coulomb=20.0, friction_linear=3000.0), np.random.default_rng(4)
    log = simulate(CIRCUIT, make_drive("steps", 2.0, 1e-3, rig, rng), 1e-3, rig, sensors=BENCH, rng=rng)
    assert sliding_excess(sliding_pressure(log, rig)) == 0.0
