"""Tests of the stand-ins for withheld sets, on which the defaults of identification are judged."""

import numpy as np
import pytest

from benchmarks.identification import identification_stand_ins as module
from benchmarks.identification.identification_sets_data import PublicSet
from benchmarks.identification.identification_stand_ins import MACHINES, stand_in_sets
from estimation.arrays import Array


@pytest.fixture(scope="module")
def sets() -> dict[str, PublicSet]:
    return {one.name: one for one in stand_in_sets(1)}


def test_every_machine_has_finite_records_with_a_varying_output(sets: dict[str, PublicSet]) -> None:
    assert {name.split(" ")[0] for name in sets} == {name.split(" ")[0] for name in (*MACHINES, "Duffing")}
    for one in sets.values():
        for u, y in (one.train, *one.tests.values()):
            assert np.isfinite(u).all()
            assert np.isfinite(y).all()
            assert y.std() > 0.0
            assert u.shape == (y.size, 1)


def test_machines_keep_their_physics(sets: dict[str, PublicSet]) -> None:
    position = np.concatenate(
        [sets["pneumatic position"].train[1], *(y for _, y in sets["pneumatic position"].tests.values())]
    )
    assert np.abs(position).max() < 0.17, "end stops at 0.15 m"
    speed, moved = (sets[f"motor {name}"].train[1] for name in ("speed", "position"))
    assert np.corrcoef(np.gradient(moved, 0.01), speed)[0, 1] > 0.9
    drives = sets["coupled drives"].train[1]
    assert drives.min() > -0.1 * drives.std(), "the sign is not measured"
    warm = sets["heat exchanger"].train[1]
    assert warm.min() > 0.0
    assert warm.max() < 1.0, "between its two inlets"


def test_the_arrow_test_of_the_duffing_set_exceeds_the_amplitude_of_the_training(sets: dict[str, PublicSet]) -> None:
    reached = [np.abs(one[1]).max() for one in (sets["Duffing"].train, *sets["Duffing"].tests.values())]
    assert reached[1] < 1.1 * reached[0] < reached[2]


def test_a_seed_determines_the_log_of_a_stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MACHINES", {"damper": MACHINES["damper"]})
    first, again, other = (stand_in_sets(seed)[0].train[1] for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert first.size != other.size or not np.array_equal(first, other)


def test_other_records_are_of_the_same_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MACHINES", {"damper": MACHINES["damper"]})
    alone, one = stand_in_sets(1)[0], stand_in_sets(1, again=2)[0]
    assert np.array_equal(alone.train[1], one.train[1]), "they change nothing of the log"
    (u, y), (v, z) = one.again.values()
    assert u.shape == v.shape == one.tests[""][0].shape
    assert not np.array_equal(u, v)
    assert not alone.again

    def gain(part: tuple[Array, Array]) -> float:
        return float(np.polyfit(part[0][:, 0], part[1], 1)[0])

    own = gain(one.tests[""])
    assert gain((u, y)) == pytest.approx(own, rel=0.3)
    assert gain((v, z)) == pytest.approx(own, rel=0.3)


@pytest.mark.parametrize("name", MACHINES)
def test_no_machine_answers_inputs_that_are_still_to_come(name: str) -> None:
    _, make = MACHINES[name]
    u = np.random.default_rng(2).uniform(-1.0, 1.0, 60)
    whole, half = (make(part, np.random.default_rng(1)) for part in (u, u[:30]))
    for output, y in half.items():
        assert np.array_equal(y, whole[output][:30])


def test_speeds_have_no_mean(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MACHINES", {"damper": MACHINES["damper"]})
    for seed in (1, 2):
        one = stand_in_sets(seed)[0]
        assert np.concatenate([one.train[0], one.tests[""][0]]).mean() == pytest.approx(0.0, abs=1e-12)
