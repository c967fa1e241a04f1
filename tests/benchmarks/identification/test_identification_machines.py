"""Tests of the simulated machines on which the defaults of identification are judged."""

import numpy as np
import pytest

from benchmarks.identification import identification_machines
from benchmarks.identification.identification_machines import MACHINES, machine_sets


def test_a_machine_whose_simulation_blows_up_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    some = {"two tanks": MACHINES["two tanks"], "broken": lambda u, _: np.full(u.size, np.nan)}
    monkeypatch.setattr(identification_machines, "MACHINES", some)
    assert [one.name for one in machine_sets(1)] == ["two tanks"]


def test_a_seed_determines_the_log_of_a_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(identification_machines, "MACHINES", {"two tanks": MACHINES["two tanks"]})
    first, again, other = (machine_sets(seed)[0].train[1] for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert first.size != other.size or not np.array_equal(first, other)
