import ctypes
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.filters.export_c import filter_problem
from benchmarks.peers.c_filter import build_filter
from estimation.engine.contract import FilterProblem
from estimation.export.c_filter import EXPORTED, filter_in_c
from estimation.export.task import EXPORTED_FORMS, filter_task
from estimation.filters.methods import METHODS
from estimation.filters.run import in_si
from estimation.models.eha_forms import BULK_MODULUS
from estimation.trust.consistency import LARGEST_NIS
from faults.conditions import CONDITIONS
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError, LogError
from plant.log.record import Record
from tests.c_compiler import SANITIZED, compiled, compiler, ran
from tests.thinned import thinned

DOUBLES = ctypes.POINTER(ctypes.c_double)
SHORT, LONG = 3_000, 100_000
EXACT = "-DEXPORTED_EXACT"
"""The library fuses products, so that no test depends on the processor."""


def rows_of(problem: FilterProblem) -> list[str]:
    rows = np.column_stack([problem.drives, problem.measured])
    return [",".join("" if np.isnan(one) else repr(float(one)) for one in row) for row in rows]


def in_c(folder: Path, problem: FilterProblem, method: str = "ekf", *flags: str, **how: str) -> tuple[np.ndarray, str]:
    """Return values, then deviations, shape (2, samples, states); and the text that is written at the end."""
    files = filter_in_c(problem, method, name="exported", precision=how.get("precision", "double"))
    out, said = ran(compiled(folder, files, *(flags or (EXACT,)), using=how.get("using", "gcc")), rows_of(problem))
    found = np.loadtxt(out.splitlines(), delimiter=",")
    return np.stack([found[:, ::2], found[:, 1::2]]), said


def in_python(problem: FilterProblem, method: str = "ekf") -> np.ndarray:
    trace = METHODS[method](replace(problem, every=1))
    mean, slope = problem.model.to_si(trace.track)
    return np.stack([mean, np.sqrt(np.maximum(trace.track_variance, 0.0)) * slope])


def apart(found: np.ndarray, wanted: np.ndarray) -> float:
    return float(np.max(np.abs(found - wanted) / np.max(np.abs(wanted), axis=1, keepdims=True)))


@pytest.mark.parametrize(
    ("form", "using"),
    thinned(
        [(form, using) for form in EXPORTED_FORMS for using in ("gcc", "clang")],
        [("pressure", "gcc"), ("chambers_by_mass", "gcc")],
    ),
)
def test_every_form_gives_the_same_result_in_c_and_in_python(form: str, using: str, tmp_path: Path) -> None:
    problem = filter_problem(form, "minor_friction", SHORT)
    assert apart(in_c(tmp_path, problem, using=using)[0], in_python(problem)) < 1e-12


@pytest.mark.parametrize("form", ["acceleration", "pressure"])
def test_without_fused_products_the_c_filter_differs_from_python_by_rounding_only(form: str, tmp_path: Path) -> None:
    problem = filter_problem(form, "minor_friction", SHORT)
    assert 0.0 < apart(in_c(tmp_path, problem, "ekf", "-O2")[0], in_python(problem)) < 1e-12


@pytest.mark.parametrize(
    "form", thinned([form for form in EXPORTED_FORMS if form not in ("acceleration", "pressure")], ["flow"])
)
def test_a_form_sensitive_to_rounding_uses_fused_products_unless_they_are_switched_off(
    form: str, tmp_path: Path
) -> None:
    problem = filter_problem(form, "normal", SHORT)
    exact = in_c(tmp_path, problem, "ekf", "-O2")[0]
    assert apart(exact, in_python(problem)) < 1e-14
    assert apart(in_c(tmp_path, problem, "ekf", "-DEXPORTED_ROUNDED_TWICE")[0], exact) > 1e-14


def test_a_compiler_that_may_fuse_products_itself_gives_the_same_bits(tmp_path: Path) -> None:
    problem = filter_problem("pressure", "minor_friction", SHORT)
    found = in_c(tmp_path, problem, "ekf", "-std=gnu17", "-march=native", EXACT)[0]
    assert np.array_equal(found, in_c(tmp_path, problem)[0])


@pytest.mark.slow
@pytest.mark.parametrize(  # three of the nine conditions for each form; `benchmarks export_c` has every pair
    ("form", "condition"),
    [(form, name) for i, form in enumerate(EXPORTED_FORMS) for name in list(CONDITIONS)[i % 3 :: 3]],
)
def test_c_and_python_agree_over_a_hundred_thousand_steps(form: str, condition: str, tmp_path: Path) -> None:
    problem = filter_problem(form, condition, LONG)
    assert apart(in_c(tmp_path, problem)[0], in_python(problem)) < 1e-12


@pytest.mark.parametrize("method", thinned([name for name in EXPORTED if name not in ("ekf", "imm")], ["ukf"]))
def test_every_update_rule_gives_the_same_result_in_c_and_in_python(method: str, tmp_path: Path) -> None:
    problem = filter_problem("pressure", "normal", 500)
    assert apart(in_c(tmp_path, problem, method)[0], in_python(problem, method)) < 1e-12


def test_nine_interacting_filters_give_the_same_result_in_c_and_in_python(tmp_path: Path) -> None:
    problem = filter_problem("pressure", "minor_leakage", 1000)
    found, said = in_c(tmp_path, problem, "imm", EXACT, *SANITIZED)
    assert apart(found[0][None], in_python(problem, "imm")[0][None]) < 1e-12
    assert "_MODES 9" in filter_in_c(problem, "imm", name="exported")["exported.h"]
    likelihood = float(said.split("log likelihood: ")[1])
    assert likelihood == pytest.approx(METHODS["imm"](problem).log_likelihood, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("form", EXPORTED_FORMS)
def test_the_c_filter_runs_without_errors_under_sanitizers(form: str, tmp_path: Path) -> None:
    assert np.all(np.isfinite(in_c(tmp_path, filter_problem(form, "normal", 500), "ekf", EXACT, *SANITIZED)[0]))


def test_missing_samples_substeps_and_robust_updates_are_treated_as_in_python(tmp_path: Path) -> None:
    problem = filter_problem("pressure", "normal", SHORT)
    measured = problem.measured.copy()
    measured[::3, 0] = np.nan
    measured[100:200] = np.nan
    measured[1000, 1] += 1.0
    problem = replace(problem, measured=measured, substeps=3, robust="student-t")
    assert apart(in_c(tmp_path, problem)[0], in_python(problem)) < 1e-12


def test_log_likelihood_and_normalised_innovations_equal_those_of_python(tmp_path: Path) -> None:
    problem = filter_problem("pressure", "normal", SHORT)
    trace = METHODS["ekf"](problem)
    _, said = in_c(tmp_path, problem)
    assert float(said.split("log likelihood: ")[1]) == pytest.approx(trace.log_likelihood, rel=1e-12)
    shown = [float(one) for one in re.findall(r"innovation \d: (\S+)", said)]
    assert shown == pytest.approx(list(in_si(problem, trace, 0.0).nis.values()), rel=1e-5)


@pytest.mark.parametrize(("shrunk", "wanted"), thinned([(1.0, 0), (1e-2, 1), (1e-6, 3)], [(1.0, 0), (1e-6, 3)]))
def test_the_gate_rates_innovations_by_their_predicted_variance(shrunk: float, wanted: int, tmp_path: Path) -> None:
    problem = filter_problem("pressure", "normal", SHORT)
    noise = np.random.default_rng(0).normal(size=problem.measured.shape) * np.sqrt(problem.variances)
    problem = replace(problem, measured=problem.measured + noise, variances=problem.variances * 2.0 * shrunk)
    _, said = in_c(tmp_path, problem)
    worst = max(float(one) for one in re.findall(r"innovation \d: (\S+)", said))
    assert (worst > LARGEST_NIS) == (wanted > 0)
    assert f"gate: {wanted}\n" in said


def test_in_single_precision_bulk_modulus_agrees_with_python_within_two_percent(tmp_path: Path) -> None:
    problem = filter_problem("pressure", "normal", LONG // 4)
    found, wanted = in_c(tmp_path, problem, precision="float")[0][0], in_python(problem)[0]
    place = problem.model.index(BULK_MODULUS)
    assert 0.0 < abs(found[-1, place] / wanted[-1, place] - 1.0) < 0.02


@pytest.mark.parametrize("method", ["ekf", "imm"])
def test_a_copy_of_a_filter_continues_with_the_same_bits(method: str, tmp_path: Path) -> None:
    compiler("gcc")
    problem, half = filter_problem("pressure", "normal", 400), 200
    library = build_filter(problem, method, tmp_path, flags=()).library
    first = ctypes.create_string_buffer(1 << 16)
    rows = [
        (np.ascontiguousarray(u), np.ascontiguousarray(y))
        for u, y in zip(problem.drives, problem.measured, strict=True)
    ]

    def step(filtered: object, begin: int, end: int) -> None:
        for drive, sample in rows[begin:end]:
            library.exported_step(filtered, drive.ctypes.data_as(DOUBLES), sample.ctypes.data_as(DOUBLES))

    library.exported_start(first, ctypes.byref(ctypes.c_char.in_dll(library, "exported_defaults")))
    step(first, 0, half)
    copy = ctypes.create_string_buffer(first.raw, 1 << 16)
    step(first, half, 400)
    assert copy.raw != first.raw
    step(copy, half, 400)
    assert copy.raw == first.raw


def test_header_and_source_have_no_allocation_no_goto_and_only_bounded_loops() -> None:
    for method in ("ekf", "imm"):
        files = filter_in_c(filter_problem("pressure", "normal", 500), method, name="exported")
        text = files["exported.h"] + files["exported.c"]
        assert re.findall(r"#include <(\S+)>", text) == ["math.h"]
        assert not re.search(r"\b(malloc|calloc|goto|while|do)\b", re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL))
        assert all(re.search(r"; \w+ < \d+;|; \w+ < \w+;", loop) for loop in re.findall(r"for \(.*\)", text))


def test_the_header_contains_names_and_units() -> None:
    header = filter_in_c(filter_problem("pressure", "normal", 500), name="exported")["exported.h"]
    assert "EXPORTED_ROW_PISTON_AREA = 1, /* m^2, effective piston area A */" in header
    assert "EXPORTED_STATE_BULK_MODULUS_PA = 3 /* Pa; inside over 1e+08 */" in header
    counts = [int(one) for one in re.findall(r"^ \* +(\d+) ", header, re.MULTILINE)]
    assert f"#define EXPORTED_OPERATIONS {sum(counts)} " in header


def test_a_step_of_the_acceleration_form_skips_operations_with_zeros_of_the_jacobian() -> None:
    header = filter_in_c(filter_problem("acceleration", "normal", 500), name="exported")["exported.h"]
    found = re.search(r"EXPORTED_OPERATIONS (\d+)", header)
    assert found is not None
    assert int(found[1]) <= 156  # 163 if every entry of F P F' is summed over the column's terms


def test_an_unknown_method_or_form_and_a_log_without_a_needed_channel_are_refused() -> None:
    problem = filter_problem("pressure", "normal", 500)
    with pytest.raises(HydrostateError, match=r"a method that can be exported must be one of ekf, .*, got 'particle'"):
        filter_in_c(problem, "particle", name="exported")
    with pytest.raises(
        HydrostateError, match=r"form must be one of acceleration, pressure, flow, chambers, .*got 'motion'"
    ):
        filter_task(Record(1e-3, {"position_m": np.zeros(9)}), EhaParameters(), "motion")
    with pytest.raises(LogError, match="the flow form needs differential_pressure_pa"):
        filter_task(
            Record(1e-3, {"position_m": np.zeros(9), "motor_speed_rad_s": np.zeros(9)}), EhaParameters(), "flow"
        )


def test_a_tuned_filter_has_the_noise_of_its_log() -> None:
    problem = filter_problem("pressure", "normal", 2000)
    record = Record(
        1e-4,
        {"motor_speed_rad_s": problem.drives[:, 0]}
        | {name: problem.measured[:, c] for c, name in enumerate(problem.channels)},
    )
    plain = filter_task(record, EhaParameters(), "pressure")
    tuned = filter_task(record, EhaParameters(), "pressure", tuned=True)
    assert not np.allclose(plain.noise, tuned.noise) or not np.allclose(plain.variances, tuned.variances)
    wide = filter_task(record, EhaParameters(), "pressure", states=("leakage_coefficient",))
    assert [state.name for state in wide.model.states][-1] == "leakage_coefficient"


def test_the_example_refuses_rows_without_commas(tmp_path: Path) -> None:
    program = compiled(tmp_path, filter_in_c(filter_problem("pressure", "normal", 500), name="exported"))
    done = subprocess.run([str(program)], input="90 0.01 0.02 1e5\n", capture_output=True, text=True, check=False)  # noqa: S603
    assert done.returncode == 1
    assert done.stderr.startswith("a row needs 4 fields with commas between them, got: 90 0.01")


def test_the_example_refuses_a_log_whose_first_column_is_time(tmp_path: Path) -> None:
    program = compiled(tmp_path, filter_in_c(filter_problem("pressure", "normal", 500), name="exported"))
    rows = "time_s,motor_speed_rad_s,position_m,velocity_m_s,differential_pressure_pa\n0,90,0.01,0.02,1e5\n"
    done = subprocess.run([str(program)], input=rows, capture_output=True, text=True, check=False)  # noqa: S603
    assert done.returncode == 1
    assert done.stderr.startswith("a row needs 4 fields with commas between them, got: 0,90,0.01")
