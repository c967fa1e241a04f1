"""The page on one log."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from estimation.finding import Finding
from estimation.notes import EstimateCode
from experiments.batch.diagnosis import class_row
from experiments.eha.diagnosis_page import diagnosis_page
from experiments.eha.entries import diagnosis_entries
from experiments.eha.verdict_words import verdict_lines
from experiments.page.rig_table import rig_rows
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.diagnose import diagnose_log
from faults.diagnosis.not_told import without_undetermined
from faults.notes import ClassCode
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import RIG


@pytest.fixture(scope="module")
def diagnosed() -> tuple[Finding, Record]:
    p = parameters_for(CONDITIONS["minor_leakage"])
    rng = np.random.default_rng(2)
    drive = make_drive("steps", 2.0, 1e-3, EhaParameters(), rng)
    log = simulate(CIRCUIT, drive, 1e-3, p, sensors=RIG, rng=rng).replace(differential_pressure_pa=None)
    return diagnose_log(log, Rig()), log


@pytest.fixture(scope="module")
def page(diagnosed: tuple[Finding, Record]) -> str:
    found, log = diagnosed
    assert (found.condition, found.unknown) == ("minor_leakage", False)
    result = {"file": "run.csv", "rig": "paper", **diagnosis_entries(found)}
    return diagnosis_page({**result, "not_told": ["one thing is not told", "another neither"]}, found, log)


def test_the_page_gives_the_fault_its_severity_and_the_work_to_do(page: str) -> None:
    heading = "The actuator probably leaks inside more than it should (minor leakage); friction is probably normal."
    assert f"<h1>{heading}</h1>" in page
    assert page.index("What to do") < page.index("How far from the limits") < page.index("Measured and fitted")
    assert "Plan a check of pump and piston seal." in page
    assert "Describe your actuator in a rig file" in page
    assert "The fault was there before the log began." in page
    assert page.count("data:image/svg+xml;base64,") == 2
    assert page.count('class="limit"') == 6


def test_every_paragraph_begins_with_a_capital_and_ends_with_a_full_stop(page: str) -> None:
    paragraphs = [re.sub("<[^>]*>", "", one).strip() for one in re.findall("<p>(.*?)</p>", page, re.DOTALL)]
    assert "One thing is not told." in paragraphs
    assert [one for one in paragraphs if not (one[0].isupper() and one.endswith("."))] == []


def test_severities_of_an_unknown_log_are_marked_as_not_reliable(page: str, diagnosed: tuple[Finding, Record]) -> None:
    found, log = diagnosed
    unknown = diagnosis_page(
        {
            "file": "run.csv",
            "rig": "paper",
            **diagnosis_entries(found),
            "unknown": True,
            "reasons": [],
            "not_told": ["one thing is not told"],
        },
        replace(found, unknown=True),
        log,
    )
    assert "if the actuator is in one of the nine" not in unknown
    assert "None of the nine conditions fits the log." in unknown
    assert "One thing is not told." not in unknown
    assert len(re.findall("<input[^>]* data-doubted>", unknown)) == unknown.count('class="limit"') > 0
    assert not re.search("<input[^>]* data-doubted>", page)


def test_severities_that_the_log_does_not_determine_have_no_state(diagnosed: tuple[Finding, Record]) -> None:
    found, log = diagnosed
    codes = [ClassCode.FRICTION_NOT_VISIBLE]
    unseen = replace(found, severities=without_undetermined(found.severities, codes))
    page = diagnosis_page({"file": "run.csv", "rig": "bench 7", **diagnosis_entries(unseen)}, unseen, log)
    assert re.findall('<input class="limit"[^>]*name="([a-z_]+)"', page) == [
        "leakage_flow",
        "bulk_modulus",
        "entrained_air",
    ]
    assert "The log does not determine: velocity lost, friction added at rated speed, pressure rise." in page
    said = verdict_lines({"file": "run.csv", **diagnosis_entries(unseen)})
    assert "  friction  friction added at rated speed not determined; pressure rise not determined" in said
    assert set(json.loads(class_row(unseen)["quantities"])) == {"leakage_flow", "bulk_modulus", "entrained_air"}


def test_what_makes_the_numbers_surer_is_said_below_them(diagnosed: tuple[Finding, Record]) -> None:
    found, log = diagnosed
    measure = EstimateCode.KNOWN_AS_THE_RIG.note(entry="chamber_volume", percent=91.0, quantity="bulk_modulus")
    noted = replace(found, notes=(measure,))
    result = {"file": "run.csv", "rig": "bench 7", **diagnosis_entries(noted)}
    page = diagnosis_page({**result, "rig_rows": rig_rows(Rig("bench 7"))}, noted, log)
    said = page.replace("\N{NO-BREAK SPACE}", " ")
    assert "<p>Measure chamber_volume, and list it under measured in the rig file: its uncertainty there" in said
    assert "The rig file, entry by entry" in page
    assert "<code>chamber_volume</code>" in page
    doubted = replace(noted, unknown=True)
    assert "Measure chamber_volume" not in diagnosis_page(
        {**result, "unknown": True, "reasons": ["the pump is worn"]}, doubted, log
    )


def test_a_page_names_the_rig_that_the_log_was_compared_with(page: str, diagnosed: tuple[Finding, Record]) -> None:
    assert "diagnosis of run.csv, no rig file of your own: the paper&#39;s actuator is assumed" in page
    found, log = diagnosed
    named = diagnosis_page({"file": "run.csv", "rig": "bench 7", **diagnosis_entries(found)}, found, log)
    assert "diagnosis of run.csv, rig bench 7<" in named


def test_the_probability_of_faults_outside_the_nine_is_given(diagnosed: tuple[Finding, Record]) -> None:
    found, log = diagnosed
    told = sum(found.probabilities.values())
    worn = replace(found, probabilities={name: 0.25 / told * share for name, share in found.probabilities.items()})
    page = diagnosis_page({"file": "run.csv", "rig": "paper", **diagnosis_entries(worn)}, worn, log)
    assert "The remaining 75\N{NO-BREAK SPACE}% is that of faults that are none of the nine and that the log" in page
    assert "if the actuator is in one of the nine" not in page
    rare = replace(found, probabilities={name: 0.995 / told * share for name, share in found.probabilities.items()})
    page = diagnosis_page({"file": "run.csv", "rig": "paper", **diagnosis_entries(rare)}, rare, log)
    assert "The remaining 0.5\N{NO-BREAK SPACE}% is that of faults" in page  # the shares above are of 99.5 %
