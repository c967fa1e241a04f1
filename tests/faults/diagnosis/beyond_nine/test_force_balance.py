"""The force balance of a sliding piston determines the force, spring and inertia on its rod, with their errors."""

from dataclasses import replace

import numpy as np
import pytest

from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.beyond_nine.force_balance import (
    BREAKAWAY_TRAVEL,
    HIDDEN_INERTIA,
    Loads,
    force_balance,
    friction_prior,
    sliding_blocks,
)
from faults.diagnosis.circuits.blocks import Blocks
from plant.arrays import Array
from plant.components.oil import ATMOSPHERE
from plant.eha.model import EhaParameters

PAPER = EhaParameters()
STEP, PLACE = 0.01, -0.006
TIME = STEP * np.arange(600)
NOISE = np.array([1e-5, 500.0])


def to_and_fro(one_way: bool = False) -> Array:
    """Return velocities over blocks [m/s]: two frequencies, so that position does not determine velocity."""
    swing = 0.02 * np.sin(2.0 * np.pi * 0.7 * TIME) + 0.01 * np.sin(2.0 * np.pi * 1.9 * TIME)
    return 0.001 + np.abs(swing) if one_way else swing


def blocks_under(
    p: EhaParameters, velocity: Array, force: float = 0.0, stiffness: float = 0.0, mass: float = 0.0
) -> Blocks:
    """Return a log of a piston that slides under a load, from equation 5.9 with 3 N of noise."""
    position = PLACE + STEP * (np.cumsum(velocity) - 0.5 * velocity)
    rubbing = (
        p.friction_quadratic * velocity * np.abs(velocity)
        + p.friction_linear * velocity
        + p.friction_coulomb * np.sign(velocity)
    )
    inertia = (p.moving_mass + mass) * np.gradient(velocity, STEP)
    noise = np.random.default_rng(3).normal(0.0, 3.0, len(velocity))
    push = rubbing + inertia + p.load_force + force + (p.load_stiffness + stiffness) * position + noise
    return Blocks(np.zeros(6001), 1e-3, 10, velocity, push / p.piston_area, NOISE, place=PLACE)


def seen(blocks: Blocks, p: EhaParameters = PAPER) -> Loads:
    found = force_balance(blocks, p)
    assert found is not None
    return found


def test_force_spring_and_inertia_are_estimated_together_within_their_intervals() -> None:
    true = {"load_force": -700.0, "load_stiffness": 9e3, "moving_mass": 250.0}
    found = seen(blocks_under(PAPER, to_and_fro(), *true.values()))
    assert found.significant == tuple(true)
    for name, value in true.items():
        got, std = found.of(name)
        assert abs(got - value) < 2.0 * std
    assert found.of("load_force")[1] < 10.0
    assert found.of("load_stiffness")[1] < 0.2 * true["load_stiffness"]
    assert HIDDEN_INERTIA < found.of("moving_mass")[1] < 0.2 * true["moving_mass"]


def test_the_force_balance_shows_no_load_on_a_rod_without_one() -> None:
    found = seen(blocks_under(PAPER, to_and_fro()))
    assert found.certain == ()
    assert abs(found.of("load_force")[0]) < 5.0


def test_a_significant_but_small_load_is_not_accepted() -> None:
    found = seen(blocks_under(PAPER, to_and_fro(), force=20.0))
    assert (found.certain, found.significant) == (("load_force",), ())


def test_the_rig_files_load_and_two_piston_areas_are_not_reported_as_a_load() -> None:
    rig = replace(PAPER, load_force=400.0, load_stiffness=2e4)
    assert seen(blocks_under(rig, to_and_fro()), rig).certain == ()
    rod = replace(PAPER, area_difference=0.2)
    one = blocks_under(PAPER, to_and_fro())
    assert one.pressure is not None
    # with two areas, the force depends on both chamber pressures, and one chamber has the inner circuit's pressure
    difference = one.pressure - 0.2 * 2.0 * (PAPER.accumulator_pressure - ATMOSPHERE)
    difference = np.where(difference > 0.0, difference / 1.2, difference / 0.8)
    found = seen(replace(one, pressure=difference), rod)
    assert found.significant == ()
    assert abs(found.of("load_force")[0]) < 5.0


def test_a_force_equal_to_that_of_the_precharge_on_unequal_areas_is_not_significant() -> None:
    rod = replace(PAPER, area_difference=0.2)
    own = PAPER.piston_area * 0.2 * 2.0 * (PAPER.accumulator_pressure - ATMOSPHERE)
    one = blocks_under(PAPER, to_and_fro(), force=own)
    assert seen(one).certain == ("load_force",)
    assert one.pressure is not None
    assert seen(replace(one, pressure=one.pressure / (1.0 + 0.2 * np.sign(one.pressure))), rod).certain == ()
    assert seen(one, rod).of("load_force")[1] == pytest.approx(own, rel=0.05)


@pytest.mark.parametrize("condition", ["normal", "major_friction"])
def test_one_way_motion_leaves_the_force_as_uncertain_as_coulomb_friction(condition: str) -> None:
    p = parameters_for(CONDITIONS[condition], PAPER)
    found = seen(blocks_under(p, to_and_fro(one_way=True), force=2000.0))
    force, std = found.of("load_force")
    assert std == pytest.approx(friction_prior(PAPER)[1][0], rel=0.05)
    assert abs(force - 2000.0) < std
    assert found.significant == ("load_force",)


def test_there_is_no_force_balance_without_pressure_or_motion() -> None:
    moving = blocks_under(PAPER, to_and_fro(), force=500.0)
    assert force_balance(replace(moving, pressure=None), PAPER) is None
    standing = blocks_under(PAPER, 1e-6 * to_and_fro(), force=500.0)
    assert force_balance(standing, PAPER) is None


def test_a_piston_slides_only_after_its_seals_have_broken_loose_behind_a_reversal() -> None:
    velocity = np.concatenate([np.full(40, 0.002), np.full(40, -0.002), np.zeros(10)])
    velocity[60] = np.nan
    blocks = Blocks(np.zeros(901), 1e-3, 10, velocity, velocity, NOISE)
    found = sliding_blocks(blocks)
    strained = round(BREAKAWAY_TRAVEL / (0.002 * STEP))
    assert not np.any(found[: strained + 1])
    assert np.all(found[strained + 1 : 39])
    assert not np.any(found[39 : 40 + strained])
    assert np.all(found[42 + strained : 59])
    assert not np.any(found[59 : 61 + strained])
    assert not np.any(found[79:])
