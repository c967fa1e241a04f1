"""The heading of a log's page, and the sentence about the finding."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.finding import Finding, Gate, Outcome, Quantity
from estimation.notes import ChannelCode, EstimateCode
from experiments.log_pages.entries import message_of
from experiments.log_pages.finding_page import (
    FRICTION_UNLIKE,
    _message_rest,
    _row,
    _title,
    _with_first_reason,
    finding_page,
)
from plant.log.record import Record

PASSED, DOUBTED = Gate(True, ()), Gate(False, (EstimateCode.DIVERGED.note(),))


def found(**changes: object) -> Finding:
    plain = Finding(
        actuator="eha",
        outcome=Outcome.OK,
        quantities={"bulk_modulus": Quantity.normal(2.07e8, 1e6, "Pa")},
        gate=PASSED,
        channels=("velocity_m_s",),
    )
    return replace(plain, **changes)


@pytest.mark.parametrize(
    ("changes", "title"),
    [
        ({}, "Bulk modulus is 207 MPa; the consistency check passed."),
        ({"quantities": {"load": Quantity(2.0, "N")}}, "Estimated values, which passed the consistency check."),
        ({"gate": DOUBTED}, "Estimated values, but do not rely on them."),
        ({"quantities": {"bulk_modulus": Quantity(None, "Pa")}}, "No values: the log contains too little."),
        (
            {"quantities": {"bulk_modulus": Quantity(None, "Pa")}, "outcome": Outcome.MISMATCH},
            "No values: the model does not fit the log.",
        ),
        ({"condition": "minor_leakage", "probabilities": {"minor_leakage": 0.9}}, "Found: minor leakage."),
        ({"condition": "minor_leakage", "unknown": True}, "No verdict: the log does not fit any known condition."),
        (
            {"unknown": True, "against": (ChannelCode.CHANNELS_SWAPPED.note(),)},
            "No verdict: columns of the log are not what they are called.",
        ),
        (
            {"unknown": True, "against": (ChannelCode.NOTHING_CHANGES.note(channel="position_m"),)},
            "No verdict: no value changes in this log.",
        ),
    ],
)
def test_the_title_states_result_gate_and_outcome(changes: dict[str, object], title: str) -> None:
    assert _title(found(**changes)).startswith(title)


def page_of(rig: str, **changes: object) -> str:
    one = found(**changes)
    notes = [note.to_dict() for note in one.notes]
    result = {"file": "run.csv", "rig": rig, "message": message_of(one), "notes": notes}
    record = Record(1e-3, {"velocity_m_s": np.linspace(0.0, 1.0, 20)})
    return finding_page(result, one, record)


MEASURE = EstimateCode.KNOWN_AS_THE_RIG.note(entry="chamber_volume", percent=91.0, quantity="bulk_modulus")


def test_what_to_measure_and_to_describe_is_among_what_to_do() -> None:
    page = page_of("paper", notes=(MEASURE,))
    to_do = page.split('<ol class="todo">')[1].split("</ol>")[0]
    assert "<li>Measure chamber_volume, and list it under measured in the rig file: " in to_do
    assert '<li class="screen-only">Describe your actuator in a rig file' in to_do
    assert page.count("Measure chamber_volume") == 1
    assert "Describe your actuator" not in page_of("P-12", notes=(MEASURE,))
    assert "What to do" not in page_of("P-12")
    assert '<div class="screen-only">\n<h2 class="first">What to do' in page_of("paper")


def test_a_friction_model_that_does_not_fit_is_followed_by_what_helps() -> None:
    doubted = Gate(False, (EstimateCode.POSITION_RESIDUALS_LARGE.note(ratio=2.3, motion_percent=0.2),))
    assert FRICTION_UNLIKE in page_of("P-12", gate=doubted)
    assert FRICTION_UNLIKE not in page_of("P-12", gate=DOUBTED)


def test_the_opening_sentence_gives_the_first_reason_and_counts_the_others() -> None:
    whole = "Bulk modulus 144 MPa; do not rely on it: A is off; B is off; C is off"
    assert _with_first_reason(whole, ["A is off.", "B is off", "C is off"]).endswith(
        "A is off; 2 more reasons stand below"
    )
    assert _with_first_reason("do not rely on it: A is off; B is off", ["A is off", "B is off"]).endswith(
        "1 more reason stands below"
    )
    assert _with_first_reason("do not rely on it: A is off", ["A is off"]) == "do not rely on it: A is off"


def test_a_condition_that_the_gate_doubts_is_reported_with_the_reason() -> None:
    named = {"condition": "minor_leakage", "probabilities": {"minor_leakage": 0.9}}
    assert "not to be relied on" not in message_of(found(**named))
    said = message_of(found(**named, gate=DOUBTED))
    assert said.startswith("minor leakage")
    assert f"not to be relied on: {EstimateCode.DIVERGED.note()}" in said


def test_bulk_modulus_is_shown_in_mpa_and_numbers_contain_no_breaking_space() -> None:
    row = _row("bulk_modulus", Quantity.normal(2.07e8, 1e6, "Pa"))
    assert (row["quantity"], row["value"], row["interval"]) == ("bulk modulus [MPa]", "207.0", "205.0 to 209.0")
    leak = _row("leakage_coefficient", Quantity.normal(2.5e-11, 1e-13, "m^3/(s Pa)"))
    assert (leak["quantity"], leak["value"]) == ("leakage coefficient [L/(min\N{NO-BREAK SPACE}bar)]", "0.1500")
    small = _row("spring", Quantity.normal(2.5e-11, 1e-13, "m/N"))
    assert " " not in small["value"]
    assert small["interval"].split(" ")[1] == "to"


def test_the_part_of_the_message_that_the_title_gives_is_not_repeated() -> None:
    assert _message_rest("Air in the oil: 4.9 %.", "air in the oil: 4.9 %; leakage is normal") == "leakage is normal"
    assert _message_rest("Found: minor leakage.", "minor leakage; it grows") == "minor leakage; it grows"
    assert _message_rest("No fault.", "no fault") == ""


def test_a_fraction_is_shown_in_percent() -> None:
    row = _row("air_fraction", Quantity.normal(0.049, 1e-5, "1"))
    assert (row["quantity"], row["value"], row["interval"]) == ("air fraction [%]", "4.900", "4.898 to 4.902")
