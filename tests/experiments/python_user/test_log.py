"""A log in Python: as a table, and drawn."""

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

import hydrostate as hs
from estimation.eha.result import BulkModulusEstimate
from plant.errors import LogWarning


@pytest.fixture(scope="module")
def log() -> hs.Log:
    return hs.simulate(duration=0.5, sample_time=1e-3)


def test_a_table_has_one_row_per_sample_by_time_and_one_column_per_channel(log: hs.Log) -> None:
    table = log.to_frame()
    assert table.index.name == "time_s"
    assert table.index.to_numpy() == pytest.approx(1e-3 * np.arange(len(table)))
    assert list(table) == list(log.channels)
    for name in log.channels:
        np.testing.assert_array_equal(table[name], log.record[name])


def test_every_channel_is_drawn_over_one_time_axis(log: hs.Log) -> None:
    axes = log.plot()
    try:
        assert [axis.get_ylabel() for axis in axes][:2] == ["motor speed [rad/s]", "position [m]"]
        assert [axis.get_xlabel() for axis in axes] == [""] * (len(axes) - 1) + ["time [s]"]
        for axis, name in zip(axes, log.channels, strict=True):
            np.testing.assert_array_equal(axis.lines[0].get_ydata(), log.record[name])
    finally:
        plt.close("all")


def test_an_option_of_the_wrong_kind_is_refused_before_any_work(log: hs.Log) -> None:
    with pytest.raises(hs.HydrostateError, match="form must be a text such as 'auto', got 3"):
        log.estimate(form=3)
    with pytest.raises(hs.HydrostateError, match="start_std must be a number, got 'wide'"):
        log.estimate(start_std="wide")
    with pytest.raises(hs.HydrostateError, match="did you mean 'form'"):
        log.estimate(forms="auto")
    with pytest.raises(hs.HydrostateError, match="no_pressure must be True or False, got 'no'"):
        log.estimate(no_pressure="no")
    with pytest.raises(hs.HydrostateError, match=r"states must be a text, got \['leakage'\]"):
        log.estimate(method="ekf", states=["leakage"])


def test_a_truth_value_of_numpy_is_one(log: hs.Log) -> None:
    assert log.estimate(no_pressure=np.bool_(False)).to_dict() == log.estimate().to_dict()


def test_a_channel_that_is_taken_for_an_attribute_is_said_to_be_an_item(log: hs.Log) -> None:
    with pytest.raises(AttributeError, match=r"log\['position_m'\] is that channel"):
        log.position_m  # noqa: B018
    assert not hasattr(log, "position_m")


def test_a_parameter_of_the_actuator_is_no_option_and_an_fmus_are_no_actuators() -> None:
    with pytest.raises(hs.HydrostateError, match=r"give it in a rig file, or as rig=replace\(rig, parameters="):
        hs.simulate(bulk_modulus=1e9)
    with pytest.raises(hs.HydrostateError, match="parameter needs fmu=FILE; parameters of the actuator stand in its"):
        hs.simulate(parameter="bulk_modulus=1e9")


def test_a_sample_time_that_a_logs_time_contradicts_is_told(log: hs.Log) -> None:
    with pytest.warns(LogWarning, match=r"are 0\.001 s apart: this is used, and not the 0\.002 s that were given"):
        assert hs.read(log.to_frame(), sample_time=2e-3).sample_time == pytest.approx(1e-3)
    assert hs.read(log.to_frame(), sample_time=1.001e-3).sample_time == pytest.approx(1e-3)


def test_an_answer_is_compared_with_an_answer_and_says_nothing_of_what_one_of_them_lacks(log: hs.Log) -> None:
    verdict = log.diagnose()
    with pytest.raises(hs.HydrostateError, match=r"compare needs another answer, such as log\.diagnose\(\), got Log"):
        verdict.compare(log)  # type: ignore[arg-type]
    table = verdict.compare(log.estimate())
    assert table.loc["leakage_flow", "second"] != table.loc["leakage_flow", "second"]
    assert table["changed"].isna().tolist() == table["low"].isna().tolist()
    assert table["changed"].isna().any()
    assert not table["changed"].isna().all()


def test_between_cuts_a_log_and_refuses_a_range_that_is_not_forward(log: hs.Log) -> None:
    part = log.between(0.1, 0.2)
    assert (part.record.start_time, len(part.record)) == (pytest.approx(0.1), 101)
    np.testing.assert_array_equal(part.record["position_m"], log.record["position_m"][100:201])
    assert len(log.between(0.1, float("inf")).record) == len(log.record) - 100
    for begin, end in ((0.2, 0.1), (0.1, 0.1), (-0.1, 0.2), (float("-inf"), 0.2), (0.1, float("nan"))):
        with pytest.raises(hs.HydrostateError, match="from an earlier to a later time"):
            log.between(begin, end)


def test_an_answer_has_the_entries_of_the_finding_and_suggests_names_for_a_misspelt_one(log: hs.Log) -> None:
    answer = log.estimate()
    assert answer.outcome == answer.finding.outcome
    assert "outcome" in dir(answer)
    with pytest.raises(AttributeError, match="did you mean 'outcome'"):
        _ = answer.outcom
    with pytest.raises(AttributeError):
        _ = answer._outcome
    with pytest.raises(KeyError, match=r"^the answer has no 'bulk_moduls'; did you mean 'bulk_modulus'"):
        _ = answer.quantities["bulk_moduls"]
    assert answer.quantities.get("bulk_moduls") is None


def test_two_answers_are_compared_as_a_table(log: hs.Log) -> None:
    found = log.estimate()
    table = found.compare(found)
    modulus = table.loc["bulk_modulus"]
    assert modulus["unit"] == "Pa"
    assert (modulus["first"], modulus["difference"]) == (found.bulk_modulus.value, 0.0)
    assert modulus["low"] < 0.0 < modulus["high"]
    assert not modulus["changed"]


def test_errors_name_the_python_arguments(log: hs.Log) -> None:
    with pytest.raises(hs.HydrostateError, match=r"^form must be one of auto, "):
        log.estimate(form="best")
    with pytest.raises(hs.HydrostateError, match=r"^start_std must be positive"):
        log.estimate(start_std=-1.0)
    with pytest.raises(hs.HydrostateError, match=r"^drive must be one of sine, "):
        hs.simulate(drive="square")


@pytest.mark.parametrize("seed", [-1, 1.5, True])
def test_a_seed_that_is_not_a_whole_number_from_0_up_is_refused(seed: int) -> None:
    with pytest.raises(hs.HydrostateError, match="seed must be a whole number from 0 up"):
        hs.simulate(seed=seed)


def test_an_answer_writes_its_page_or_is_refused_with_the_reason(log: hs.Log, tmp_path: Path) -> None:
    answer = log.estimate()
    page = answer.report(tmp_path / "page", title="bench 7, Monday")
    assert page == tmp_path / "page.html"
    text = page.read_text(encoding="utf-8")
    assert text.startswith("<!DOCTYPE html>")
    assert "bench 7, Monday" in text
    assert answer.report(tmp_path / "new" / "folder" / "page.html").exists()
    with pytest.raises(hs.HydrostateError, match="cannot be written"):
        answer.report(page / "page.html")


def test_a_transfer_function_writes_its_page(log: hs.Log, tmp_path: Path) -> None:
    page = log.identify().report(tmp_path / "model", title="bench 7, Monday").read_text(encoding="utf-8")
    assert "bench 7, Monday" in page
    assert "held-back" in page


def test_a_diagnosis_writes_the_page_of_its_actuator(log: hs.Log, tmp_path: Path) -> None:
    page = log.diagnose().report(tmp_path / "page.html").read_text(encoding="utf-8")
    assert "leakage" in page
    assert "<canvas" in page or "uPlot" in page


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """Return the channels of each log from which bulk modulus is estimated."""
    from estimation.eha import estimate as module

    asked, estimated = list[tuple[str, ...]](), module.estimate_clean

    def counted(*given: Any) -> BulkModulusEstimate:
        asked.append(tuple(given[0].record))
        return estimated(*given)

    monkeypatch.setattr(module, "estimate_clean", counted)
    return asked


def _checked_again(*_: object) -> None:
    raise AssertionError("a log that was checked is checked again")


@pytest.mark.parametrize("verbs", [("estimate", "diagnose"), ("diagnose", "estimate")])
def test_estimate_and_diagnose_share_one_fit_and_give_the_same_results_as_alone(
    log: hs.Log, fits: list[tuple[str, ...]], verbs: tuple[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = [getattr(hs.Log(log.record, log.rig), verb)().to_dict() for verb in verbs]
    assert len(fits) == 2
    both = hs.Log(log.record, log.rig)
    assert [getattr(both, verb)().to_dict() for verb in verbs] == alone
    assert len(fits) == 3
    with monkeypatch.context() as stood_in:
        stood_in.setattr("estimation.log_checks.clean.clean_log", _checked_again)
        assert [getattr(both, verb)().to_dict() for verb in verbs] == alone
    copied = pickle.loads(pickle.dumps(both))  # noqa: S301 - our own
    assert copied.estimate().to_dict() == both.estimate().to_dict()
    assert len(fits) == 4


def test_a_fit_is_shared_only_with_the_same_channels_rig_record_and_method(
    log: hs.Log, fits: list[tuple[str, ...]]
) -> None:
    both = hs.Log(log.record, log.rig)
    both.estimate()
    both.diagnose(no_pressure=True)
    both.estimate(condition="major_leakage")
    both.estimate(start=3e8)
    assert ["differential_pressure_pa" in channels for channels in fits] == [True, False, True, True]
    both.rig = replace(both.rig, parameters=replace(both.rig.parameters, piston_area=1.6e-3))
    both.diagnose()
    both.record = log.between(0.0, 0.4).record
    both.diagnose()
    assert len(fits) == 6


def test_a_warning_points_to_the_file_of_the_caller(log: hs.Log) -> None:
    table = log.to_frame().assign(position_m=1e3 * log["position_m"])
    with pytest.warns(LogWarning) as caught:
        hs.read(table)
    assert {one.filename for one in caught} == {__file__}


def test_a_log_made_of_a_path_is_refused_with_a_hint(log: hs.Log) -> None:
    with pytest.raises(hs.HydrostateError, match="made of a Record, got str; hydrostate"):
        hs.Log("run.csv", hs.Rig())  # type: ignore[arg-type]
    with pytest.raises(hs.HydrostateError, match="must be a Rig, got str; hydrostate"):
        hs.Log(log.record, "rig.toml")  # type: ignore[arg-type]


@pytest.mark.parametrize("verb", ["estimate", "diagnose"])
def test_a_pickled_answer_is_restored_unchanged(log: hs.Log, verb: str, tmp_path: Path) -> None:
    answer = getattr(log, verb)()
    copied = pickle.loads(pickle.dumps(answer))  # noqa: S301 - our own
    assert str(copied) == str(answer)
    pages = [one.report(tmp_path / f"{name}.html").read_text("utf-8") for name, one in (("a", answer), ("b", copied))]
    assert pages[0] == pages[1]


def test_a_numpy_integer_is_accepted_as_a_seed() -> None:
    runs = [hs.simulate(duration=0.1, sample_time=1e-3, seed=seed) for seed in (3, np.int64(3))]
    assert np.array_equal(runs[0]["position_m"], runs[1]["position_m"])


def test_invalid_times_and_model_sizes_are_refused(log: hs.Log) -> None:
    with pytest.raises(hs.HydrostateError, match="must be seconds, got 'a' and 1"):
        log.between("a", 1)  # type: ignore[arg-type]
    for size, said in (
        ({"order": -1}, "order must be from 1 to 20, got -1"),
        ({"order": 0}, "order must be from 1 to 20, got 0"),
        ({"order": 21}, "order must be from 1 to 20, got 21"),
        ({"order": 2, "n_numerator": 0}, "n_numerator must be 1 or more, got 0"),
        ({"order": 2, "delay": 10**6}, "a model of this size and dead time needs a log of at least 2000025 samples"),
        ({"order": 2, "delay": 10**6, "structure": "state-space"}, "needs a log of at least 2000015 samples"),
    ):
        with pytest.raises(hs.HydrostateError, match=said):
            log.identify(input="motor_speed_rad_s", output="velocity_m_s", **size)


def test_a_channel_without_samples_is_left_out_of_a_part_with_a_warning(log: hs.Log) -> None:
    """Before, the fit asked for "a signal with at least one finite sample", without naming file or channel."""
    late = log["differential_pressure_pa"].copy()
    late[: len(log) // 2] = np.nan
    whole = hs.Log(log.record.replace(differential_pressure_pa=late), log.rig)
    with pytest.warns(LogWarning, match="differential_pressure_pa is missing in 201 of 201 samples"):
        part = whole.between(0.0, 0.2)
    assert "differential_pressure_pa" not in part.channels
