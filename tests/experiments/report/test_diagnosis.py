"""The page on one log."""

import re
from typing import Any

import numpy as np
import pytest

from experiments.command.verdict import verdict_entries
from experiments.report.diagnosis import diagnosis_page
from faults.class_fit import Actuator
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis import diagnose_log
from plant.eha import EhaParameters
from plant.sensors import RIG
from plant.signals import make_drive
from plant.simulate import CIRCUIT, simulate


@pytest.fixture(scope="module")
def page() -> str:
    p = parameters_for(CONDITIONS["minor_leakage"])
    rng = np.random.default_rng(2)
    drive = make_drive("steps", 3.0, 1e-3, EhaParameters(), rng)
    log = simulate(CIRCUIT, drive, 1e-3, p, sensors=RIG, rng=rng).replace(differential_pressure_pa=None)
    found = diagnose_log(log, Actuator.of(EhaParameters()))
    result: dict[str, Any] = {"file": "run.csv", "rig": "paper", "channels": list(log), **verdict_entries(found)}
    return diagnosis_page({**result, "not_told": ["one thing is not told", "another neither"]}, found)


@pytest.mark.slow
def test_the_page_says_what_how_bad_since_when_and_what_next(page: str) -> None:
    assert "<h1>Minor leakage, probability" in page
    for heading in ("Which condition", "How bad", "Since when", "Measured and fitted", "What to measure next"):
        assert heading in page
    assert "Since before the log began." in page
    assert page.count("data:image/svg+xml;base64,") == 3


@pytest.mark.slow
def test_every_paragraph_begins_with_a_capital_and_ends_with_a_full_stop(page: str) -> None:
    paragraphs = [re.sub("<[^>]*>", "", one).strip() for one in re.findall("<p>(.*?)</p>", page, re.DOTALL)]
    assert "One thing is not told." in paragraphs
    assert [one for one in paragraphs if not (one[0].isupper() and one.endswith("."))] == []
