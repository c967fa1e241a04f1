"""Means over blocks equal those of the channel computed sample by sample."""

from types import SimpleNamespace

import numpy as np
import pytest

from plant.eha.circuit_parameters import CircuitParameters, circuit_values
from plant.eha.simulate import CIRCUIT
from plant.solvers import block_means as module
from plant.solvers.block_means import LANES, block_means
from plant.solvers.block_means_loop import average_blocks
from plant.solvers.steps import parameter_row
from tests.kernels import functions_of, on_memory, text_of

PRESSURE = "differential_pressure_pa"
ROW, START = parameter_row(CircuitParameters()), CIRCUIT.start(parameter_row(CircuitParameters()))


def runs(count: int, samples: int) -> np.ndarray:
    return START[:, None] * (1.0 + 1e-4 * np.random.default_rng(1).standard_normal((samples, len(START), count)))


def as_written(states: np.ndarray, rows: np.ndarray, block: int) -> np.ndarray:
    seen = CIRCUIT.observe(tuple(np.moveaxis(states, 1, 0)), circuit_values(rows))[PRESSURE]
    whole = len(seen) // block
    return seen[: whole * block].reshape(whole, block, -1).mean(axis=1)


@pytest.mark.parametrize("each", [False, True], ids=["one_row", "a_row_a_sample"])
def test_block_means_equal_the_means_of_the_observed_channel(each: bool) -> None:
    states = runs(LANES + 1, 23)
    drift = np.random.default_rng(2).uniform(0.9, 1.1, (23 if each else 1, LANES + 1, 1))
    rows = ROW * np.where(np.arange(len(ROW)) == CIRCUIT_COLUMN, drift, 1.0)
    found = block_means(CIRCUIT.observe, PRESSURE, states, rows, 5, CircuitParameters)
    np.testing.assert_allclose(found, as_written(states, rows, 5), rtol=1e-9, atol=1e-3)


CIRCUIT_COLUMN = list(CircuitParameters.__dataclass_fields__).index("bulk_modulus")


def test_a_nan_in_one_run_makes_only_the_mean_of_that_run_nan() -> None:
    states = runs(3, 20)
    sound = block_means(CIRCUIT.observe, PRESSURE, states, np.tile(ROW, (1, 3, 1)), 10, CircuitParameters)
    states[12, :, 1] = np.nan
    found = block_means(CIRCUIT.observe, PRESSURE, states, np.tile(ROW, (1, 3, 1)), 10, CircuitParameters)
    assert np.isnan(found[1, 1])
    found[1, 1] = sound[1, 1]
    np.testing.assert_array_equal(found, sound)


def test_the_averaging_loop_gives_the_same_in_python_and_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    states, rows = runs(LANES, 6), np.tile(ROW, (1, LANES, 1))
    made_of = CIRCUIT.observe, PRESSURE, len(START), CircuitParameters
    file = functions_of(text_of(monkeypatch, module, lambda: module._compile.__wrapped__(*made_of)))
    plain = SimpleNamespace(**vars(file))
    plain.VECTOR = 1
    for name in ("settle", "show"):
        setattr(plain, f"{name}_at", on_memory(file, getattr(file, name)))
    found = np.empty((2, LANES))
    average_blocks(plain, states, rows, 3, found)
    wanted = block_means(CIRCUIT.observe, PRESSURE, states, rows, 3, CircuitParameters)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-3)
