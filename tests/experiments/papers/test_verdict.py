import math

import pytest

from experiments.page.numbers import MINUS, TIMES
from experiments.papers.study import _our_cell, _tolerance
from experiments.papers.verdict import (
    Basis,
    OurResult,
    Row,
    accepted_range,
    agrees,
    exclusion_sentence,
    figure_status,
    verdict_of,
)
from experiments.published.digits import digits_half
from plant.errors import HydrostateError


def row(
    value: float | str | None = 2.0,
    ours: OurResult = OurResult(2.0),  # noqa: B008 - frozen
    *,
    printed: str = "2.0",
    accept: str = "digits",
    basis: Basis = "computed",
    errata: str = "",
) -> Row:
    return Row(
        paper="002",
        where="section 1",
        claim="a claim",
        printed=printed,
        value=value,
        unit="",
        accept=accept,
        basis=basis,
        ours=ours,
        errata=errata,
        shown_by="hydrostate study",
    )


@pytest.mark.parametrize(
    ("basis", "verdict"), [("computed", "reproduced"), ("model", "predicted"), ("target", "calibrated")]
)
def test_the_verdict_on_an_agreeing_value_follows_from_its_basis(basis: Basis, verdict: str) -> None:
    assert verdict_of(row(basis=basis)) == verdict
    assert verdict_of(row(basis=basis, errata="E7")) == verdict


def test_a_disagreeing_value_is_an_erratum_only_if_one_is_cited() -> None:
    assert verdict_of(row(ours=OurResult(2.06))) == "not reproduced"
    assert verdict_of(row(ours=OurResult(2.06), errata="E7")) == "erratum"
    assert verdict_of(row(ours=OurResult(None), errata="E7")) == "erratum"
    assert verdict_of(row(ours=OurResult(math.nan), basis="target")) == "not reproduced"


def test_the_tolerance_digits_is_half_a_unit_of_the_last_printed_digit() -> None:
    assert agrees(row(ours=OurResult(2.05)))
    assert not agrees(row(ours=OurResult(2.0501)))
    assert not agrees(row(ours=OurResult(2.05), printed="2.00"))
    assert digits_half("-7.440e3") == 0.5


def test_an_interval_agrees_if_it_overlaps_the_tolerance() -> None:
    assert agrees(row(ours=OurResult(3.0, 2.04, 3.96)))
    assert not agrees(row(ours=OurResult(3.0, 2.06, 3.94)))
    assert not agrees(row(ours=OurResult(1.0, 0.0, 1.94)))


@pytest.mark.parametrize(
    ("accept", "limits"),
    [
        ("± 0.5", (1.5, 2.5)),
        ("± 10 %", (1.8, 2.2)),
        ("1 to 4", (1.0, 4.0)),
        ("at least 1.5", (1.5, math.inf)),
        ("at most 1.5", (-math.inf, 1.5)),
    ],
)
def test_every_form_of_tolerance_is_read(accept: str, limits: tuple[float, float]) -> None:
    assert accepted_range(row(accept=accept)) == pytest.approx(limits)


@pytest.mark.parametrize("accept", ["near", "± 10 per cent of it", "", "±"])
def test_a_tolerance_that_cannot_be_read_is_refused(accept: str) -> None:
    with pytest.raises(HydrostateError, match="cannot be read"):
        verdict_of(row(accept=accept))


def test_a_relative_tolerance_without_a_printed_number_is_refused() -> None:
    with pytest.raises(HydrostateError, match="needs a printed number"):
        verdict_of(row(value=None, accept="± 1 %"))


def test_words_are_compared_exactly() -> None:
    assert agrees(row("Brass", OurResult("Brass"), accept="same"))
    assert not agrees(row("Brass", OurResult("brass"), accept="same"))
    assert not agrees(row("never falls", OurResult(9.7), accept="same"))


def test_a_figure_with_a_claim_that_is_not_reproduced_is_drawn_with_a_difference() -> None:
    assert figure_status(True, "", ["predicted", "not reproduced"]) == "drawn with a difference"
    assert figure_status(True, "signs mended", ["predicted"]) == "drawn with a difference"
    assert figure_status(True, "", []) == "drawn"
    assert figure_status(False, "a photograph", ["predicted"]) == "cannot be drawn"


@pytest.mark.parametrize(
    ("accept", "said"),
    [
        ("digits", "half a unit of the last digit"),
        ("0.32258064516132 to 7.777777777777871", "0.3226 to 7.778"),
        ("± 10 %", "± 10 %"),
        ("at least 2", "at least 2"),
    ],
)
def test_a_tolerance_is_shown_in_words_with_four_digits(accept: str, said: str) -> None:
    assert _tolerance(accept) == said


def test_an_interval_that_excludes_the_printed_value_is_detected() -> None:
    assert exclusion_sentence(row(2.0, OurResult(2.5, 2.4, 2.6)))
    assert not exclusion_sentence(row(2.0, OurResult(2.1, 1.9, 2.3)))
    assert not exclusion_sentence(row(2.0, OurResult(2.5)))
    assert not exclusion_sentence(row(None, OurResult(0.5, 0.4, 0.6), accept="at least 1"))


@pytest.mark.parametrize(
    ("printed", "value", "shown"),
    [
        ("5.57e-7", 5.57e-7, f"5.570{TIMES}10⁻⁷"),
        ("-7.440e3", -7451.0, f"{MINUS}7.4510{TIMES}10³"),
        ("58", 62.11, "62.11"),
        (f"2.07{TIMES}10⁸", 5.426518e6, f"5.4265{TIMES}10⁶"),  # the 10 of the power is no printed digit
    ],
)
def test_our_value_is_shown_with_the_power_of_ten_of_the_printed_one(printed: str, value: float, shown: str) -> None:
    cell = _our_cell({"ours": value, "printed": printed})
    assert shown in str(getattr(cell, "text", cell))
