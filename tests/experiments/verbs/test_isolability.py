import json

import pytest
from typer.testing import CliRunner, Result

from experiments.cli import app

QUICK = ("--seconds", "3", "--rate", "500")


def _run(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["isolability", *QUICK, *arguments])


def test_the_card_shows_structure_and_nearest_rivals() -> None:
    done = _run()
    assert done.exit_code == 0
    assert "told from all" in done.stdout
    assert "distance [nats/s]" in done.stdout
    assert "all conditions can be told apart" in done.stdout


def test_json_contains_all_pairs_of_conditions() -> None:
    (found,) = json.loads(_run("--drive", "sine", "--sensors", "position,velocity", "--json").stdout)
    assert len(found["nats_per_second"]) == len(found["conditions"]) == 9
    assert "friction" in found["not_told_from"]["leakage"]
    assert found["nearest"]["minor_leakage"]["wrong_verdicts_percent"] == pytest.approx(50.0)
    assert "cannot be told apart" in found["message"]


def test_the_option_duration_is_an_alias_of_seconds() -> None:
    (found,) = json.loads(_run("--duration", "2", "--json").stdout)
    assert found["seconds"] == 2.0


def test_drives_are_ranked_by_their_hardest_pair() -> None:
    ranked = json.loads(_run("--rank", "--json").stdout)
    least = [one["hardest_nats_per_second"] for one in ranked]
    assert least == sorted(least, reverse=True)
    assert ranked[-1]["drive"] == "sine"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--sensors", "smell"), "--sensors must be one of"),
        (("--noise", "loud"), "--noise must be one of"),
        (("--drive", "kick"), "--drive must be one of"),
        (("--seconds", "-1"), "--seconds (--duration) must be positive"),
    ],
)
def test_invalid_options_are_refused(arguments: tuple[str, ...], said: str) -> None:
    done = _run(*arguments)
    assert done.exit_code == 2
    assert said in done.stderr


def test_the_ranking_has_one_line_per_drive_and_names_the_best() -> None:
    done = _run("--rank")
    assert done.exit_code == 0
    ranked = json.loads(_run("--rank", "--json").stdout)
    drives = [one["drive"] for one in ranked]
    shown = [line.split()[0] for line in done.stdout.splitlines() if line.split()[:1] and line.split()[0] in drives]
    assert shown[: len(drives)] == drives
    assert f"{drives[0]} is the most informative" in done.stdout
