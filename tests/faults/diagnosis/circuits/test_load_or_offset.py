"""Without pressure, a load on the rod that the rig file does not state is not taken for an offset of motor speed."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from faults.diagnosis.circuits import load_or_offset, out_of_model
from faults.diagnosis.circuits.blocks import Blocks, blocks_of
from faults.diagnosis.circuits.class_fit import fit_freely
from faults.diagnosis.circuits.class_regions import fit_classes, nearest_score
from faults.diagnosis.circuits.load_or_offset import load_for_offset
from faults.diagnosis.circuits.out_of_model import reasons_against
from faults.notes import AgainstCode
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.simulate import CIRCUIT, simulate
from plant.notes import Note
from plant.sensors.sensors import RIG
from tests.faults.diagnosis.short_logs import ACTUATOR, PAPER

CODES = {AgainstCode.SPEED_BIAS, AgainstCode.LOAD_UNTOLD, AgainstCode.LOAD_OR_OFFSET}


@cache
def log(force: float = 0.0, stiffness: float = 0.0, offset: float = 0.0) -> Blocks:
    """Return a log without pressure, with a force, a spring and an offset that the rig file lacks [N, N/m, rad/s]."""
    p, rng = replace(circuit_of(PAPER), load_force=force, load_stiffness=stiffness), np.random.default_rng(4)
    made = simulate(CIRCUIT, make_drive("steps", 6.0, 2e-3, PAPER, rng), 2e-3, p, sensors=RIG, rng=rng)
    speed = made["motor_speed_rad_s"] + offset
    return blocks_of(made.replace(differential_pressure_pa=None, motor_speed_rad_s=speed))


def said_of(blocks: Blocks) -> list[Note]:
    fits = fit_classes(blocks, ACTUATOR)
    against = reasons_against(blocks, fits, nearest_score(fits, blocks, ACTUATOR), ACTUATOR)
    return [note for note in against if note.code in CODES]


def test_a_load_is_named_with_its_rig_file_entry_and_an_offset_of_speed_as_an_offset(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (load,) = said_of(log(force=700.0))
    assert (load.code, load.data["entry"]) == (AgainstCode.LOAD_UNTOLD, "load_force")
    assert float(load.data["value"]) == pytest.approx(700.0, rel=0.3)
    (offset,) = said_of(log(offset=6.0))
    assert offset.code is AgainstCode.SPEED_BIAS
    monkeypatch.setattr(load_or_offset, "NAMED_ALONE_GAIN", 1e4)
    (either,) = said_of(log(offset=6.0))
    assert either.code is AgainstCode.LOAD_OR_OFFSET
    assert float(either.data["bias_rad_s"]) == float(offset.data["bias_rad_s"])


def test_a_spring_is_distinguished_from_a_constant_load() -> None:
    sprung = log(stiffness=2e4)
    without = fit_freely(sprung, ACTUATOR, "normal")
    spring = load_for_offset(sprung, ACTUATOR, "normal", without, -3.0, 14.0)
    assert spring is not None
    assert (spring.code, spring.data["entry"]) == (AgainstCode.LOAD_UNTOLD, "load_stiffness")
    assert float(spring.data["value"]) == pytest.approx(2e4, rel=0.3)


def test_neither_load_nor_offset_is_named_if_no_circuit_follows_the_log(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (load_or_offset, out_of_model):
        monkeypatch.setattr(module, "follows_velocity", lambda *_: False)
    assert not said_of(log(force=700.0))
    assert not said_of(log(offset=6.0))
