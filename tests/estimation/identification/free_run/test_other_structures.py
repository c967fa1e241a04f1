"""Structures that are not fitted by their free run, between channels: offset, and what is said of them."""

import numpy as np
import pytest

from estimation.identification.free_run.data import channels_from
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from plant.errors import LogWarning
from tests.estimation.identification.free_run.test_linear_fit import F, one_log, plant, steps


@pytest.mark.parametrize("structure", ["arx", "box-jenkins", "instrumental", "subspace", "continuous"])
def test_other_structures_have_free_runs_with_an_offset(structure: str) -> None:
    data = one_log()
    if structure == "arx":
        with pytest.warns(LogWarning, match="what it assumes of the noise does not hold"):
            found = identify_channels(data, structure=structure, order=2, delay=3)
    else:
        found = identify_channels(data, structure=structure, order=2, delay=3)
    u, y = 3.0 + steps(400, 9), plant(3.0 + steps(400, 9), 9)
    # ARX is biased by the sensor's noise
    assert found.model.quality([u[:, None]], [y + 1.5 * (steps(400, 9)[0] - steps(600, 1)[0])]).rmse < 0.3 * np.std(y)
    assert found.model.structure == structure
    assert found.held_back_percent > 70.0
    assert found.model.linear is not None
    assert found.model.linear.offset == pytest.approx(found.model.offset, abs=0.05)


def test_arx_does_not_differ_from_output_error_behind_noise_as_it_assumes() -> None:
    u = 3.0 + steps(600, 1)
    noise = filtered([1.0], F, 0.02 * np.random.default_rng(101).normal(size=u.size))
    data = channels_from([u[:, None]], [plant(u, 1, noise=0.0) + noise], 0.1, ["valve"], "level")
    for structure in ("arx", "armax", "box-jenkins"):
        assert not identify_channels(data, structure=structure, order=2, delay=3).notes


@pytest.mark.parametrize("structure", ["instrumental", "continuous", "subspace"])
def test_the_gain_of_a_plant_that_integrates_means_nothing_in_any_structure(structure: str) -> None:
    u = steps(600, 3, hold=10)
    y = filtered([0.0, 0.01, 0.005], np.polymul([1.0, -1.0], [1.0, -0.7]), u)
    y = y + y.std() / 30.0 * np.random.default_rng(3).normal(size=u.size)
    data = channels_from([u[:, None]], [y], 0.01, ["u"], "y")
    with pytest.warns(LogWarning, match="integrates"):
        found = identify_channels(data, structure=structure)
    assert IdentificationCode.INTEGRATES in {note.code for note in found.notes}


def test_instrumental_variables_warn_of_a_closed_loop_as_output_error_does() -> None:
    rng = np.random.default_rng(6)
    n, total = 1500, 0.0
    reference, noise = steps(n, 6, hold=30), 0.2 * rng.normal(size=n)
    u, x = np.zeros(n), np.zeros(n)
    for k in range(n):
        x[k] = 0.9 * x[k - 1] + 0.1 * u[k - 1] if k else 0.0
        error = reference[k] - x[k] - noise[k]
        total += 0.05 * error
        u[k] = 0.5 * error + total
    data = channels_from([u[:, None]], [x + noise], 0.01, ["u"], "y")
    with pytest.warns(LogWarning, match="closed loop"):
        found = identify_channels(data, structure="instrumental", order=1, delay=1)
    assert IdentificationCode.FEEDBACK_AT_ONCE in {note.code for note in found.notes}
