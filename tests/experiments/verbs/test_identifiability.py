import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from experiments.cli import app
from plant.eha.rig import rig_template


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["identifiability", *map(str, arguments)])


def results(*arguments: object) -> list[dict[str, Any]]:
    done = invoke(*arguments, "--json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_the_card_is_printed_with_units_and_sentences() -> None:
    shown = invoke("--sensors", "position,velocity", "--drive", "sine").stdout
    assert "least standard deviation [%]" in shown
    assert "effective bulk modulus beta" in shown
    assert "not observable with this drive and these sensors" in shown
    assert "errata E13" in shown


def test_json_contains_options_and_results() -> None:
    (found,) = results("--drive", "prbs", "--seconds", 4, "--rate", 500, "--condition", "minor_leakage", "--seed", 3)
    assert (found["drive"], found["seconds"], found["rate_hz"], found["seed"]) == ("prbs", 4.0, 500.0, 3)
    assert (found["condition"], found["outcome"]) == ("minor_leakage", "ok")
    assert found["sensors"] == ["position", "velocity", "dp"]
    assert 0.0 < found["relative_std_percent"]["bulk_modulus"] < 3.0
    assert len(found["correlation"]) == len(found["relative_std_percent"]) == 6


def test_the_order_of_the_sensors_does_not_matter() -> None:
    assert results("--sensors", "dp, position", "--seconds", 2) == results("--sensors", "position,dp", "--seconds", 2)


def test_drives_are_ranked_from_best_to_worst() -> None:
    found = results("--rank", "--sensors", "position,velocity")
    overall = [one["overall_percent"] for one in found]
    assert overall == sorted(overall)
    assert [one["rank"] for one in found] == [1, 2, 3, 4, 5]
    assert found[-1]["drive"] == "sine"
    shown = invoke("--rank", "--sensors", "position,velocity").stdout
    assert "Coulomb friction a_3 [%]" in " ".join(shown.split())  # called as without --rank
    assert shown.index(found[0]["drive"]) < shown.index("sine")
    assert "overall [%]" in shown


def test_the_uncertainty_of_the_rigs_volume_limits_that_of_bulk_modulus(tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(rig_template().replace("[uncertainty]", "[uncertainty]\nchamber_volume = 0.05"), encoding="utf-8")
    (found,) = results("--rig", rig)
    assert found["relative_std_percent"]["bulk_modulus"] == pytest.approx(5.0, rel=0.01)
    assert found["without_rig_uncertainty_percent"]["bulk_modulus"] < 0.1
    assert "chamber volume 5 %" in found["message"]


def test_results_are_written_as_csv_and_json(tmp_path: Path) -> None:
    assert invoke("--seconds", 2, "--out", tmp_path / "cards").exit_code == 0
    assert sorted(path.name for path in (tmp_path / "cards").iterdir()) == ["results.csv", "results.json"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--sensors", "position,force"), "--sensors must be one of position, velocity, dp, got 'force'"),
        (("--sensors", "dp,dp"), "--sensors names dp twice"),
        (("--noise", "ideal"), "--noise must be one of bench, paper, rig"),
        (("--noise", "paper"), "these sensors give differential_pressure_pa no noise"),
        (("--drive", "ramp"), "--drive must be one of"),
        (("--rate", "-1"), "--rate must be positive"),
        (("--seconds", "nan"), "--seconds (--duration) must be positive"),
        (("--seconds", "1e9"), "must be 2 to 2000000 samples"),
        (("--condition", "odd"), "condition must be one of normal"),
        (("--drive", "sine", "--rate", "12"), "frequency"),
    ],
)
def test_wrong_options_are_refused_with_a_precise_message(arguments: tuple[str, ...], said: str) -> None:
    refused = invoke(*arguments)
    assert refused.exit_code == 2
    expected = said.replace("bench, paper, rig", "bench, rig, paper")
    assert expected in " ".join(refused.stderr.split())
    assert refused.stdout == ""
