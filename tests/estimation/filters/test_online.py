import numpy as np
import pytest

from benchmarks.filters.export_c import filter_problem
from estimation.filters.methods import METHODS
from estimation.filters.online import RULES, OnlineFilter
from plant.errors import HydrostateError

SAMPLES = 1200


def pieces(filtered: OnlineFilter, begin: int = 0, end: int = SAMPLES, seed: int = 0) -> None:
    rng = np.random.default_rng(seed)
    while begin < end:
        stop = min(end, begin + int(rng.integers(1, 150)))
        filtered.take(filtered.problem.drives[begin:stop], filtered.problem.measured[begin:stop])
        begin = stop


@pytest.mark.parametrize(
    ("form", "method"), [("pressure", "ekf"), ("acceleration", "ukf"), ("flow", "ekf"), ("chambers", "ekf")]
)
def test_a_stream_in_pieces_of_any_length_gives_the_same_bits_as_the_filter_of_the_whole_log(
    form: str, method: str
) -> None:
    problem = filter_problem(form, "minor_leakage", SAMPLES)
    filtered = OnlineFilter(problem, method)
    pieces(filtered)
    trace, now = METHODS[method](problem), filtered.now()
    assert np.array_equal(now.values, problem.model.to_si(trace.mean)[0])
    assert np.array_equal(now.nis, trace.nis)
    assert (now.log_likelihood, filtered.taken) == (trace.log_likelihood, SAMPLES)


@pytest.mark.parametrize("method", ["ekf", "svsf"])
def test_a_resumed_filter_gives_the_same_bits_as_an_uninterrupted_one(method: str) -> None:
    problem = filter_problem("pressure", "normal", SAMPLES)
    whole, before, after = (OnlineFilter(problem, method) for _ in range(3))
    pieces(whole)
    pieces(before, end=777)
    after.resume(before.remembered())
    pieces(after, begin=777, seed=1)
    kept, wanted = after.remembered(), whole.remembered()
    assert all(np.array_equal(kept[name], wanted[name], equal_nan=True) for name in ("logs", "drive", "taken"))
    assert np.array_equal(after.now().values, whole.now().values)
    assert np.array_equal(after.now().deviations, whole.now().deviations)


def test_a_missing_drive_keeps_its_last_value_and_missing_measurements_are_not_counted() -> None:
    problem = filter_problem("pressure", "normal", 100)
    drives, measured = problem.drives.copy(), problem.measured.copy()
    drives[41:45], measured[41:45] = np.nan, np.nan
    held = drives.copy()
    held[41:45] = drives[40]
    ours, wanted = OnlineFilter(problem), OnlineFilter(problem)
    ours.take(drives[:43], measured[:43])
    ours.take(drives[43:], measured[43:])
    wanted.take(held, measured)
    assert np.array_equal(ours.now().values, wanted.now().values)
    assert ours.now().count.tolist() == [96.0] * 3


def test_an_unsuitable_method_sample_shape_or_resumed_form_is_refused() -> None:
    problem = filter_problem("pressure", "normal", 100)
    filtered = OnlineFilter(problem)
    with pytest.raises(HydrostateError, match="a method that filters a stream must be one of ekf"):
        OnlineFilter(problem, "smoother")
    with pytest.raises(HydrostateError, match=r"samples must have shapes \(n, 1\) and \(n, 3\)"):
        filtered.take(problem.drives, problem.measured[:, :2])
    with pytest.raises(HydrostateError, match="must have every drive"):
        filtered.take(np.full((1, 1), np.nan), problem.measured[:1])
    with pytest.raises(HydrostateError, match="can only continue one of the same form"):
        filtered.resume(OnlineFilter(filter_problem("acceleration", "normal", 100)).remembered())
    assert set(RULES) == {"ekf", "iekf", "ukf", "ckf", "svsf", "sif"}


def test_no_samples_change_nothing() -> None:
    problem = filter_problem("pressure", "normal", 100)
    filtered = OnlineFilter(problem, "ekf")
    pieces(filtered, 0, 50)
    before = filtered.now().values.copy()
    filtered.take(problem.drives[:0], problem.measured[:0])
    assert filtered.taken == 50
    np.testing.assert_array_equal(filtered.now().values, before)
