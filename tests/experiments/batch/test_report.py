import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from experiments.batch.cases import plan_study
from experiments.batch.folder import open_folder
from experiments.batch.log_pages import write_log_pages
from experiments.batch.part_store import PartStore, open_store
from experiments.batch.report import write_report
from experiments.batch.rows import SCHEMA
from experiments.batch.study_file import Study, read_study
from experiments.batch.summary import frame_of, summary_tables
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError
from plant.log.files import write_record
from plant.sensors.sensors import BENCH
from tests.experiments.batch.conftest import run_into, small_plan


def row(**entries: Any) -> dict[str, Any]:
    return {"plant": "lumped", "drive": "steps", "sensors": "bench", "pressure": True, "outcome": "ok", **entries}


def frame(*rows: dict[str, Any]) -> pd.DataFrame:
    return frame_of(pa.Table.from_pylist(list(rows), schema=SCHEMA))


def estimate(error: float, std: float = 2e6) -> dict[str, Any]:
    truth = 2e8
    value = truth * (1.0 + 0.01 * error)
    entries = {"verb": "filter", "form": "pressure", "method": "ekf", "condition": "normal", "error_percent": error}
    return row(**entries, true_bulk_modulus_pa=truth, bulk_modulus_pa=value, bulk_modulus_std_pa=std)


def test_the_report_gives_median_rms_and_coverage_of_errors() -> None:
    tables = summary_tables(frame(estimate(0.0), estimate(1.0), estimate(5.0)))
    (found,) = tables["bulk modulus"].to_dict("records")
    assert found["median_percent"] == pytest.approx(1.0)
    assert found["rms_percent"] == pytest.approx((26.0 / 3.0) ** 0.5)
    assert found["near_percent"] == found["covered_percent"] == pytest.approx(200.0 / 3.0)


def test_a_diagnosis_without_a_condition_is_not_counted_as_right() -> None:
    seen = [
        row(verb="diagnose", condition="normal", found_condition=name) for name in ("normal", "minor_friction", None)
    ]
    tables = summary_tables(frame(*seen))
    (found,) = tables["diagnosis"].to_dict("records")
    assert (found["cases"], found["right"]) == (3, 1)
    assert int(tables["confusion"].to_numpy().sum()) == 2


def test_a_simulated_condition_without_a_name_is_named_by_its_severities() -> None:
    free = row(verb="diagnose", leakage_severity=0.5, friction_severity=1.0)
    assert frame(free)["condition"].tolist() == ["leakage 0.5, friction 1"]


def test_the_report_needs_only_the_store_and_counts_the_missing_cases(tmp_path: Path) -> None:
    store = open_store(tmp_path / "store")
    run_into(store, small_plan())
    copy = PartStore(open_folder((tmp_path / "store").rename(tmp_path / "moved")))
    next((tmp_path / "moved" / "parts").iterdir()).unlink()
    page = Path(write_report(copy, open_folder(tmp_path / "page"))).read_text(encoding="utf-8")
    done = len(copy.rows())
    assert f"{done} of 24 cases are done; the others are still to run." in page
    assert not re.search(r'(?:src|href)="(?!#|data:)', page)
    table = pd.read_csv(tmp_path / "page" / "tables" / "bulk_modulus.csv")
    assert table["cases"].sum() == done
    assert (tmp_path / "page" / "figures" / "bulk_modulus.png").exists()


def test_a_report_that_cannot_be_written_is_an_error_with_its_path(tmp_path: Path) -> None:
    store = open_store(tmp_path / "store")
    run_into(store, small_plan(seeds=1))
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(HydrostateError, match=r"report .*file.* cannot be written: "):
        write_report(store, open_folder(tmp_path / "file" / "page"))


def reduced(study: Study, **changes: Any) -> Study:
    """Return a study with the same parts, but short runs, one seed and two first guesses."""
    runs = [one.model_copy(update={"seeds": 1, "starts_pa": one.starts_pa[::6], **changes}) for one in study.runs]
    return study.model_copy(update={"runs": tuple(runs)})


@pytest.mark.slow
def test_the_study_of_the_paper_runs_at_reduced_size(tmp_path: Path) -> None:
    conditions = ("normal", "major_leakage_major_friction")
    study = reduced(read_study("eha-paper"), conditions=conditions, duration_s=2.0, sample_time_s=5e-4)
    plan, store = plan_study(study, tmp_path), open_store(tmp_path / "store")
    assert run_into(store, plan).failed == 0
    tables = summary_tables(frame_of(store.rows()))
    ours = tables["bulk modulus"].query("verb == 'estimate' and plant == 'lumped'")
    assert len(ours) == len(conditions)
    assert ours["median_percent"].abs().max() < 3.0
    circuit = tables["diagnosis"].query("plant == 'circuit' and pressure")
    assert circuit["right"].sum() == circuit["cases"].sum() == len(conditions)
    rows = store.rows().to_pandas().query("verb == 'diagnose' and plant == 'lumped'")
    assert ((rows["found_condition"] == rows["condition"]) | (rows["outcome"] == "mismatch")).all()
    assert Path(write_report(store, store.folder)).exists()


@pytest.mark.slow
def test_the_study_of_a_fleet_runs_on_a_small_archive(tmp_path: Path) -> None:
    for number, name in enumerate(("normal", "major_leakage")):
        p, rng = parameters_for(CONDITIONS[name]), np.random.default_rng(number)
        record = simulate(LUMPED, make_drive("steps", 4.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
        (tmp_path / "archive" / name).mkdir(parents=True)
        write_record(record.annotate(condition=name), tmp_path / "archive" / name / "run.csv")
    (tmp_path / "archive" / "broken.csv").write_text("time_s,motor_speed_rad_s\n0,a\n", encoding="utf-8")
    plan, store = plan_study(read_study("fleet-archive"), tmp_path), open_store(tmp_path / "store")
    assert run_into(store, plan).failed == 2
    rows = store.rows().to_pandas().query("verb == 'diagnose' and outcome == 'ok'")
    assert (rows["found_condition"] == rows["condition"]).tolist() == [True, True]
    modulus = store.rows().to_pandas().query("verb == 'estimate' and outcome == 'ok'")["bulk_modulus_pa"]
    assert np.allclose(modulus, 2.07e8, rtol=0.03)
    assert write_log_pages(plan, store, 1) == []
    page = Path(write_report(store, store.folder)).read_text(encoding="utf-8")
    assert "broken.csv" in page
    (link,) = re.findall(r'<a href="(pages/[^"]+)">major_leakage/run.csv</a>', page)
    assert "leaks badly inside" in (tmp_path / "store" / link).read_text(encoding="utf-8")
    logs = page.split('<section id="logs">')[1].split("</section>")[0]
    assert 'class="cards whole"' in logs  # on a phone, its long texts leave no room for the rest of a row
    assert "broken.csv" in logs
    assert '<section id="failures">' not in page  # it would only repeat the table of logs
