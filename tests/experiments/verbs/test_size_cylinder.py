"""`hydrostate size-cylinder`: a small calculator on the command line."""

import json
import math

import pytest
from typer.testing import CliRunner

from experiments.cli import app

RUN = CliRunner()
DUTY = ["size-cylinder", "--force", "10000", "--speed", "0.1", "--stroke", "0.5", "--pressure", "1e7"]


def test_the_smallest_standard_cylinder_is_found() -> None:
    done = RUN.invoke(app, [*DUTY, "--json"])
    assert done.exit_code == 0, done.output
    (found,) = json.loads(done.stdout)
    assert (found["bore"], found["rod"]) == (0.04, 0.028)
    assert found["extend_force"] > 10000.0


def test_the_screen_shows_mm_bar_and_litres_per_minute() -> None:
    done = RUN.invoke(app, DUTY)
    assert done.exit_code == 0, done.output
    words = " ".join(done.stdout.split())
    assert "bore of the cylinder 40 mm" in words
    assert "flow that the pump must give 7.54 L/min" in words
    assert "setting of the relief valve, which takes the pump's flow 110 bar" in words


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--bore", "0.032", "--rod", "0.02"], "gives 6"),
        (["--bore", "0.04"], "--bore and --rod are given together"),
        (["--retract-force", "1e9"], "no standard cylinder up to 320 mm"),
        (["--retract-speed", "-1"], "retract_speed must not be negative"),
    ],
)
def test_an_impossible_cylinder_or_duty_is_refused(more: list[str], said: str) -> None:
    done = RUN.invoke(app, [*DUTY, *more])
    assert done.exit_code == 2
    assert said in " ".join(done.stderr.split())


def test_a_given_cylinder_is_calculated_if_it_is_large_enough() -> None:
    (found,) = json.loads(RUN.invoke(app, [*DUTY, "--bore", "0.05", "--rod", "0.03", "--json"]).stdout)
    assert (found["bore"], found["rod"]) == (0.05, 0.03)
    assert 10000.0 < found["extend_force"] < 1e7 * math.pi / 4.0 * 0.05**2
    assert 0.0 < found["retract_force"] < 1e7 * math.pi / 4.0 * (0.05**2 - 0.03**2)
