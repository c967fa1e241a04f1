"""The most likely split of a log into two circuits, and whether the two can be in different conditions."""

from dataclasses import replace

import numpy as np
import pytest

from faults.diagnosis.changes.split import Split, in_one_condition, likeliest_split
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import PointFit
from plant.eha.model import EhaParameters

ACTUATOR = actuator_of(EhaParameters())


def flat(velocity: np.ndarray) -> tuple[Blocks, PointFit]:
    """Return a log of one output, and a model that can only shift it."""
    blocks = Blocks(np.zeros(10 * len(velocity) + 1), 1e-3, 10, velocity, None, np.array([1.0]))
    slopes = np.zeros((7, len(velocity), 1))
    slopes[0] = 1.0
    fitted = np.full((len(velocity), 1), float(np.mean(velocity)))
    scale = np.array([float(np.std(velocity))])
    return blocks, PointFit(ACTUATOR.conditions[0], 0.0, np.eye(7), scale, fitted, slopes)


def test_a_log_is_split_at_a_jump_and_not_by_noise() -> None:
    noise = np.random.default_rng(0).normal(size=800)
    assert likeliest_split(*flat(noise)) is None
    jump = np.where(np.arange(800) < 300, 0.0, 5.0)
    split = likeliest_split(*flat(noise + jump))
    assert split is not None
    assert abs(split.place - 300) <= 1


def test_a_log_too_short_to_hold_a_change_is_not_split() -> None:
    assert likeliest_split(*flat(np.where(np.arange(150) < 75, 0.0, 9.0))) is None


@pytest.mark.parametrize("alike", [True, False])
def test_two_parts_are_in_one_condition_only_if_both_are_surely_in_the_same(*, alike: bool) -> None:
    blocks, fit = flat(np.random.default_rng(1).normal(size=800))
    sure = replace(fit, scales=blocks.noise, information=1e4 * np.eye(7))
    normal, leaking = (replace(sure, coordinates=ACTUATOR.conditions[place]) for place in (0, 2))
    assert in_one_condition(Split(300, leaking, leaking if alike else normal), blocks, ACTUATOR) == alike


def test_an_uncertain_part_is_not_surely_in_the_condition_of_the_other() -> None:
    blocks, fit = flat(np.random.default_rng(1).normal(size=800))
    sure = replace(fit, scales=blocks.noise, information=1e4 * np.eye(7))
    between = replace(sure, coordinates=0.5 * (ACTUATOR.conditions[0] + ACTUATOR.conditions[1]))
    unsure = replace(sure, information=1e-2 * np.eye(7))
    for doubtful in (between, unsure):
        assert not in_one_condition(Split(300, sure, doubtful), blocks, ACTUATOR)
