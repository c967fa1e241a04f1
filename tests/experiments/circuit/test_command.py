import json
import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from experiments.circuit.figures import CIRCUIT_FIGURES
from experiments.circuit.study import circuit_studies
from experiments.page.folder import write_tables
from plant.eha.circuit_parameters import CircuitParameters
from plant.errors import HydrostateError

COMMAND = Path(sys.executable).parent / "hydrostate"


def test_every_figure_from_3_to_11_has_its_experiment() -> None:
    names = " ".join(circuit_studies(CircuitParameters(), 1))
    assert sorted({int(number) for number in re.findall(r"figure (\d+)", names)}) == list(range(3, 12))


def test_tables_are_written_together_with_a_manifest(tmp_path: Path) -> None:
    table = pd.DataFrame({"velocity_m_s": [0.04, 0.03]})
    path = write_tables({"figure 3": table}, {"study": "circuit", "settings": {"seed": 1}}, tmp_path / "result")
    manifest = json.loads(path.read_text(encoding="utf-8"))
    assert manifest["files"] == ["manifest.json", "tables/figure_3.csv"]
    pd.testing.assert_frame_equal(pd.read_csv(tmp_path / "result/tables/figure_3.csv"), table)


def test_tables_never_replace_a_folder_that_no_study_wrote(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(HydrostateError, match=r"which holds notes\.txt"):
        write_tables({"figure 3": pd.DataFrame({"a": [1]})}, {"study": "circuit"}, tmp_path / "mine")
    assert (tmp_path / "mine" / "notes.txt").read_text(encoding="utf-8") == "mine"


@pytest.mark.slow
def test_the_circuit_study_writes_its_tables_and_the_leakage_levels_of_the_circuit(tmp_path: Path) -> None:
    line = [COMMAND, "circuit", "--quick", "--out", tmp_path / "circuit", "--seed", "7"]
    subprocess.run(line, capture_output=True, check=True)  # noqa: S603 - our own command
    tables = tmp_path / "circuit" / "tables"
    assert len(list(tables.glob("*.csv"))) == 13
    assert (tmp_path / "circuit" / "report.html").read_text(encoding="utf-8").count("<figure") == len(CIRCUIT_FIGURES)
    leakage = pd.read_csv(tables / "figure_3_velocity_against_leakage_throttle.csv").set_index("throttle_a_v")
    assert leakage.loc[2.0, "percent_of_normal"] == pytest.approx(71.4, abs=0.5)
    assert leakage.loc[1.75, "percent_of_normal"] == pytest.approx(53.1, abs=0.5)
    estimates = pd.read_csv(tables / "figure_11_bulk_modulus.csv")
    assert set(estimates["form"]) == {"flow", "pressure", "acceleration"}
