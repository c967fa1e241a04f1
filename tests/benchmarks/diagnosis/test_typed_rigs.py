"""Tests of ten rigs of other makers, with rig files as an engineer would type them."""

import numpy as np
import pytest

from benchmarks.diagnosis import typed_rigs
from benchmarks.diagnosis.typed_rigs import FILES, RIG_USES, draw_log
from experiments.open_benchmark.drives import DRIVES
from plant.eha.circuit_parameters import circuit_of
from plant.eha.rig import read_rig


def test_every_file_has_a_use_and_every_use_a_file() -> None:
    assert {file.stem for file in FILES.glob("*.toml")} == set(RIG_USES)
    assert {drive for use in RIG_USES.values() for drive in use.drives} <= set(DRIVES)


@pytest.mark.parametrize("name", RIG_USES)
def test_a_rig_file_states_the_true_accumulator_gas_or_none_and_its_circuit_keeps_the_stroke(name: str) -> None:
    p = read_rig(FILES / f"{name}.toml").parameters
    assert p.accumulator_gas in (None, pytest.approx(RIG_USES[name].gas))
    assert circuit_of(p).stroke == p.stroke


@pytest.mark.parametrize("name", ["robot_leg", "mini_pack"])
def test_a_typed_rigs_log_stays_within_the_stroke_and_is_reproducible(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(typed_rigs, "DURATION", 1.0)
    rig = read_rig(FILES / f"{name}.toml")
    setup, record = draw_log(name, rig, 1)
    assert np.max(np.abs(record["position_m"])) < 0.5 * setup.machine.stroke
    assert np.array_equal(draw_log(name, rig, 1)[1]["position_m"], record["position_m"])
    assert setup.machine.supply_gas == RIG_USES[name].gas
