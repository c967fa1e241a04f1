"""The force balance distinguishes a load that changes within a log from intermittent friction."""

from dataclasses import replace

import numpy as np
import pytest

from faults.diagnosis.advice import advice_for
from faults.diagnosis.beyond_nine.varying_load import varying_load
from faults.diagnosis.circuits.blocks import Blocks
from faults.notes import AdviceCode, AgainstCode
from plant.arrays import Array
from plant.log.record import Record
from tests.faults.diagnosis.beyond_nine.test_force_balance import PAPER, TIME, blocks_under, to_and_fro

WAVE = 500.0 * np.sin(2.0 * np.pi * 0.3 * TIME)


def under(force: Array, velocity: Array | None = None) -> Blocks:
    blocks = blocks_under(PAPER, to_and_fro() if velocity is None else velocity)
    assert blocks.pressure is not None
    return replace(blocks, pressure=blocks.pressure + force / PAPER.piston_area)


@pytest.mark.parametrize("size", [0.5, 1.0, 3.0])
def test_an_oscillating_load_is_named_with_its_rms_force(size: float) -> None:
    note = varying_load(under(size * WAVE), PAPER)
    assert note is not None
    assert note.code is AgainstCode.LOAD_VARIES
    assert note.data["force_n"] == pytest.approx(size * 500.0 / np.sqrt(2.0), rel=0.1)


def test_intermittent_friction_is_not_named_as_a_load() -> None:
    grips = np.asarray(800.0 * (np.abs(TIME - 3.0) < 0.8) * np.sign(to_and_fro()), dtype=np.float64)
    note = varying_load(under(grips), PAPER)
    assert note is not None
    assert note.code is AgainstCode.FRICTION_VARIES
    assert note.data["force_n"] == pytest.approx(800.0, rel=0.05)
    assert note.data["at_s"] == pytest.approx(3.0, abs=0.8)


def test_a_force_that_opposes_only_one_direction_is_named_as_one_way() -> None:
    grips = np.asarray(800.0 * (np.abs(TIME - 3.0) < 0.8) * np.sign(to_and_fro()), dtype=np.float64)
    note = varying_load(under(np.maximum(grips, 0.0)), PAPER)
    assert note is not None
    assert note.code is AgainstCode.GRIPS_ONE_WAY
    assert varying_load(under(np.minimum(np.abs(grips), 800.0) * np.sin(9.0 * TIME)), PAPER) is None


def test_constant_loads_and_noise_are_not_varying_loads() -> None:
    noise: Array = 100.0 * np.random.default_rng(2).standard_normal(len(TIME))
    for force in (np.zeros(len(TIME)), np.full(len(TIME), 900.0), noise, np.multiply(0.03, WAVE)):
        assert varying_load(under(force), PAPER) is None


def test_a_piston_that_slides_one_way_shows_no_varying_load() -> None:
    assert varying_load(under(WAVE, to_and_fro(one_way=True)), PAPER) is None


def test_without_pressure_no_varying_load_is_reported() -> None:
    assert varying_load(replace(under(WAVE), pressure=None), PAPER) is None


def test_the_advice_on_a_varying_force_is_to_hold_the_load_or_free_the_rod() -> None:
    record = Record(1e-3, {"motor_speed_rad_s": np.zeros(100)})
    for note, advice in (
        (AgainstCode.LOAD_VARIES.note(force_n=500.0), AdviceCode.HOLD_LOAD),
        (AgainstCode.FRICTION_VARIES.note(force_n=500.0, at_s=2.0), AdviceCode.FREE_ROD),
    ):
        assert [one.code for one in advice_for(record, {}, (note,), (), ())] == [advice]
