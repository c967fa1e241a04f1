"""An identified linear model, exported to C and to a MAT file, gives the same output as in Python."""

from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.signal import lfilter, lfiltic

from estimation.export.c_model import model_in_c
from estimation.export.mat_model import model_in_mat
from estimation.identification.free_run.data import Scaling
from estimation.identification.free_run.limited_dynamics import LimitedDynamics
from estimation.identification.free_run.limited_output import Limits
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.model import FreeRunModel
from plant.errors import HydrostateError
from tests.c_compiler import compiled, ran


def linear(denominator: tuple[float, ...]) -> FreeRunModel:
    """Return a model with two inputs, the second of which is delayed by three samples."""
    form = Form(len(denominator), (2, 1), (0, 3))
    scaling = Scaling(np.array([2.0, -1.0]), np.array([0.5, 3.0]), 10.0, 4.0)
    return FreeRunModel(
        ("valve", "load"),
        "speed",
        1e-2,
        "output-error",
        scaling,
        LinearDynamics(form, np.array([0.3, -0.1, 0.2, *denominator, 0.05])),
    )


DECAYING, INTEGRATING = (-1.5, 0.7), (-1.7, 0.7)


def inputs(count: int) -> np.ndarray:
    return np.random.default_rng(1).standard_normal((count, 2)).cumsum(axis=0)


@pytest.mark.parametrize(("precision", "apart"), [("double", 1e-12), ("float", 1e-4)])
def test_the_c_program_prints_the_free_run_of_the_model(precision: str, apart: float, tmp_path: Path) -> None:
    model, u = linear(DECAYING), inputs(500)
    program = compiled(tmp_path, model_in_c(model, name="valve_to_speed", precision=precision))
    printed, _ = ran(program, [f"{a!r},{b!r}" for a, b in u.tolist()])
    found, wanted = np.array(printed.split(), dtype=float), model.simulate(u)
    assert np.ptp(wanted) > 1.0
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=apart * np.max(np.abs(wanted)))


def test_an_integrator_begins_at_its_level_and_integrates_deviations_of_inputs_from_their_means(tmp_path: Path) -> None:
    model, u = linear(INTEGRATING), inputs(200)
    assert abs(sum((1.0, *INTEGRATING))) < 1e-12
    program = compiled(tmp_path, model_in_c(model, name="drift"))
    printed, _ = ran(program, [f"{a!r},{b!r}" for a, b in u.tolist()])
    wanted = np.full(200, model.level)
    for (b, f), one in zip(model.transfer_functions(), (u - model.scaling.u_mean).T, strict=True):
        wanted += lfilter(b, f, one, zi=lfiltic(b, f, np.zeros(f.size), np.full(b.size, one[0])))[0]
    assert np.ptp(wanted) > 1.0
    np.testing.assert_allclose(np.array(printed.split(), dtype=float), wanted, rtol=1e-9)


def test_a_mat_file_holds_the_transfer_functions() -> None:
    model, u = linear(DECAYING), inputs(300)
    (content,) = model_in_mat(model, name="speed").values()
    held = loadmat(BytesIO(content))
    u = np.concatenate([u[:1] * 0.0 + model.scaling.u_mean, u])
    out = np.full(301, float(held["output_level"].item()))
    for b, f, one in zip(held["numerator"], held["denominator"], (u - held["input_mean"]).T, strict=True):
        out += lfilter(b, f, one)
    np.testing.assert_allclose(out, model.simulate(u), rtol=1e-9)


@pytest.mark.parametrize(
    ("limits", "named"),
    [
        (Limits(-np.inf, 0.5, 0.01), "cut off at 12,"),
        (Limits(-1.0, 0.5, 0.01, stops=True), "held by stops at 6 and 12,"),
    ],
)
def test_the_export_of_a_model_with_output_limits_is_refused_with_their_name(limits: Limits, named: str) -> None:
    free = linear(DECAYING)
    assert isinstance(free.dynamics, LinearDynamics)
    model = replace(free, dynamics=LimitedDynamics(free.dynamics.form, free.dynamics.theta, limits))
    for export in (model_in_c, model_in_mat):
        with pytest.raises(HydrostateError, match=named):
            export(model, name="speed")
