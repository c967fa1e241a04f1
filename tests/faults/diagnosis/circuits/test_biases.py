"""Without pressure, an offset of motor speed counts only if the circuit then explains the log better."""

from dataclasses import replace

import pytest

from estimation.log_checks.clean import clean_log
from experiments.open_benchmark.kinds import make
from faults.diagnosis.circuits import out_of_model
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.blocks import Blocks, blocks_of
from faults.diagnosis.circuits.class_regions import fit_classes, nearest_score
from faults.diagnosis.circuits.out_of_model import reasons_against
from faults.notes import AgainstCode
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.faults.diagnosis.short_logs import ACTUATOR, blocks


def is_offset(log: Blocks) -> bool:
    fits = fit_classes(log, ACTUATOR)
    against = reasons_against(log, fits, nearest_score(fits, log, ACTUATOR), ACTUATOR)
    return any(note.code in (AgainstCode.SPEED_BIAS, AgainstCode.LOAD_OR_OFFSET) for note in against)


def test_an_offset_of_speed_is_an_objection_only_above_a_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    log = blocks(pressure=False, seconds=6.0)
    off = replace(log, speed=log.speed + 6.0)
    assert is_offset(off)
    assert not is_offset(log)
    monkeypatch.setattr(out_of_model, "BIAS_GAIN", 1e3)
    assert not is_offset(off)


def test_a_creeping_piston_shows_no_false_offset_of_speed() -> None:
    """In this log of the open benchmark, one linear step promises 3.7 rad/s in 29, and a circuit with it gains 2.7."""
    log = make("plain", "training", 9749).log
    record = Record(1e-3, {name: log[name].to_numpy() for name in ("motor_speed_rad_s", "position_m", "velocity_m_s")})
    parameters = EhaParameters()
    assert actuator_of(parameters) == ACTUATOR
    assert not is_offset(blocks_of(clean_log(record, parameters).record))
