from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.filters.export_c import SAMPLE_TIME, filter_problem
from estimation.export.fmu_filter import filter_fmu
from estimation.filters.methods import METHODS
from tests.c_compiler import compiler


@pytest.fixture(scope="module")
def fmpy() -> Any:
    compiler("gcc")
    return pytest.importorskip("fmpy", reason="FMPy is an extra of developers")


OTHERWISE = pytest.mark.slow
"""The fast tests cover one filter in one version of FMI."""


@pytest.mark.parametrize(
    ("form", "method", "fmi"),
    [
        ("pressure", "ekf", "3.0"),
        pytest.param("pressure", "imm", "2.0", marks=OTHERWISE),
        pytest.param("flow", "ekf", "3.0", marks=OTHERWISE),
        pytest.param("pressure", "ekf", "2.0", marks=OTHERWISE),
        pytest.param("pressure", "imm", "3.0", marks=OTHERWISE),
        pytest.param("flow", "ekf", "2.0", marks=OTHERWISE),
    ],
)
def test_a_filter_fmu_passes_validation_and_agrees_with_the_native_filter(
    fmpy: Any, fmi: str, form: str, method: str, tmp_path: Path
) -> None:
    from fmpy.validation import validate_fmu

    problem = filter_problem(form, "normal", 1500)
    path = tmp_path / "filter.fmu"
    path.write_bytes(filter_fmu(problem, method, fmi, name="believed"))
    assert validate_fmu(str(path)) == []
    inputs = [one for one in fmpy.read_model_description(str(path)).modelVariables if one.causality == "input"]
    assert [float(one.start) for one in inputs] == [0.0] * (len(problem.model.drives) + len(problem.channels))
    names = [*problem.model.drives, *(f"measured_{one}" for one in problem.channels)]
    time = SAMPLE_TIME * np.arange(len(problem.measured))
    rows = np.column_stack([time, problem.drives, problem.measured])
    signals = np.array([tuple(row) for row in rows], dtype=[(name, float) for name in ("time", *names)])
    span = {"start_time": 0.0, "stop_time": time[-1], "step_size": SAMPLE_TIME, "output_interval": SAMPLE_TIME}
    with np.errstate(all="ignore"):
        found = fmpy.simulate_fmu(str(path), **span, input=signals)
    mean, slope = problem.model.to_si(METHODS[method](problem).track)
    assert slope.shape == mean.shape
    for i, state in enumerate(problem.model.states):
        wanted = mean[:-1, i]  # the output at the end of a step belongs to the sample at its beginning
        assert np.max(np.abs(found[f"estimated_{state.name}"][1:] - wanted)) < 1e-6 * np.max(np.abs(wanted))
