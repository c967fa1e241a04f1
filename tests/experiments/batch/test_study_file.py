import copy
from pathlib import Path
from typing import Any

import pytest

from experiments.batch.study_file import StudyError, parse_study, read_study, shipped_studies
from tests.experiments.batch.conftest import FILTER, RUNS

GOOD: dict[str, Any] = {"name": "small", "runs": [RUNS]}


def changed(**changes: Any) -> dict[str, Any]:
    content = copy.deepcopy(GOOD)
    content["runs"][0] |= changes
    return content


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (changed(drive=["sine"]), "runs[0].drive is unknown, did you mean 'drives'?"),
        (changed(drives=["sin"]), "runs[0].drives must be one of sine, prbs, steps, chirp, multisine, got 'sin'"),
        (changed(plants=[]), "runs[0].plants must be one or more of reduced, lumped, circuit, got none"),
        (changed(seeds=0), "runs[0].seeds must be greater than or equal to 1, got 0"),
        (changed(seeds=10**8), "runs[0].seeds must be less than or equal to 1000000, got 100000000"),
        (changed(seeds=[1, -2]), "runs[0].seeds[1] must be greater than or equal to 0, got -2"),
        (changed(starts_pa=[1e8, -1.0]), "runs[0].starts_pa[1] must be greater than or equal to 0, got -1.0"),
        (changed(duration_s="long"), "runs[0].duration_s must be a valid number"),
        (changed(duration_s=1e-4), "runs[0] must be at least 10 samples long"),
        (changed(severities=[[9.0, 0.0]]), "runs[0].severities[0][0] must be less than or equal to 5, got 9.0"),
        (changed(methods=[{**FILTER, "verb": "filtr"}]), "runs[0].methods[0].verb must be 'filter', 'estimate' or"),
        (
            changed(methods=[{**FILTER, "form": "flow"}]),
            "runs[0].methods[0].form must be one of acceleration, pressure",
        ),
        (changed(methods=[{"verb": "filter", "form": "pressure"}]), "runs[0].methods[0].method must be one of ekf, "),
        ({"runs": GOOD["runs"]}, "name is needed, and not there"),
        ({"name": "a"}, "the file must have at least one [[runs]] or [[logs]], got none"),
        ({**GOOD, "log": []}, "log is unknown, did you mean 'logs'?"),
        ({**GOOD, "\x1b[2J": []}, r"'\x1b[2J' is unknown, wanted one of name"),
    ],
)
def test_every_error_names_its_field(content: dict[str, Any], said: str) -> None:
    with pytest.raises(StudyError) as caught:
        parse_study(content, "small.toml")
    assert str(caught.value).startswith(f"small.toml: {said}")


def test_every_study_file_of_the_package_can_be_read() -> None:
    assert [read_study(name).name for name in shipped_studies()] == list(shipped_studies())


def test_a_missing_or_invalid_toml_file_is_refused_by_its_path(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("name = ", encoding="utf-8")
    for name, said in (("a.toml", "a TOML file is needed"), ("b.toml", "there is no such study file; eha-paper")):
        with pytest.raises(StudyError, match=said) as caught:
            read_study(tmp_path / name)
        assert str(tmp_path / name) in str(caught.value)


def test_an_error_shows_the_beginning_of_a_long_entry() -> None:
    with pytest.raises(StudyError) as caught:
        parse_study(changed(duration_s="a" * 9000), "small.toml")
    assert len(str(caught.value)) < 300
