"""Numbers and tables as a reader sees them."""

import pandas as pd
import pytest

from experiments.page.numbers import TIMES, exact, fixed, number, percent_text, pretty_unit
from experiments.page.tables import Cell, Column, folded_tables, html_table


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [
        (0.0431142, 3, "0.0431"),
        (428231.9, 4, f"428.2{TIMES}10³"),
        (9.99999, 3, "10.0"),
        (99999.96, 4, f"100.0{TIMES}10³"),
        (4.784e-12, 4, f"4.784{TIMES}10⁻¹²"),
        (-1.2345e-7, 3, f"\N{MINUS SIGN}123{TIMES}10⁻⁹"),
        (0.0, 3, "0"),
    ],
)
def test_exponents_are_multiples_of_three_and_digits_as_given(value: float, digits: int, shown: str) -> None:
    assert number(value, digits) == shown


@pytest.mark.parametrize("value", [None, float("nan"), float("inf")])
def test_a_missing_number_is_shown_as_a_dash(value: float | None) -> None:
    assert number(value) == fixed(value, 2) == "\N{EN DASH}"


def test_zero_has_no_sign_when_rounded() -> None:
    assert fixed(-0.0004, 2) == "0.00"


@pytest.mark.parametrize("value", [1.52e-3, 65890.0, 6.006e-11, 3.4475e6, -7440.0, 0.25])
def test_an_exact_number_is_shown_without_rounding(value: float) -> None:
    mantissa, _, power = exact(value).replace("\N{MINUS SIGN}", "-").partition(f"{TIMES}10")
    exponent = power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")) or "0"
    assert float(f"{mantissa}e{exponent}") == pytest.approx(value, rel=1e-12)


def test_exponents_of_units_are_superscripts() -> None:
    assert pretty_unit("m^3/(s Pa)") == "m³/(s Pa)"


def test_cells_are_escaped() -> None:
    frame = pd.DataFrame({"a": ["<b>1 & 2</b>"]})
    html = html_table(frame, (Column("a", "a < b"),), "1 > 0")
    assert "&lt;b&gt;1 &amp; 2&lt;/b&gt;" in html
    assert "a &lt; b" in html
    assert "1 &gt; 0" in html


def test_values_are_scaled_to_the_unit_of_the_header() -> None:
    html = html_table(pd.DataFrame({"v": [0.0431]}), (Column("v", "velocity", "mm/s", 1e3, 3),), "")
    assert '<th scope="col" class="number">velocity<small>mm/s</small></th>' in html
    assert '<td class="number">43.1</td>' in html


def test_a_cell_has_the_class_of_its_tone() -> None:
    html = html_table(pd.DataFrame({"v": [True]}), (Column("v", "v", words=lambda _: Cell("yes", "good")),), "")
    assert '<td class="good">yes</td>' in html


@pytest.mark.parametrize(
    ("probability", "said"), [(1.0, "> 99.9"), (0.9991, "> 99.9"), (0.999, "99.9"), (0.001, "0.1"), (0.0009, "< 0.1")]
)
def test_a_probability_is_never_shown_as_0_or_100_percent(probability: float, said: str) -> None:
    assert percent_text(probability) == said


def test_a_folded_table_has_a_summary_for_each_group_and_omits_the_group_column() -> None:
    frame = pd.DataFrame({"where": ["T 1", "T 2", "T 1"], "claim": ["a", "b", "c"], "verdict": ["yes", "no", "no"]})
    html = folded_tables(frame, ("where", Column("claim"), "verdict"), "where", "verdict")
    lines = [one.split("</summary>")[0] for one in html.split("<summary>")[1:]]
    assert lines == ["T 1: 2 rows (1 yes, 1 no)", "T 2: 1 row, no"]
    assert html.count("<td") == 2 * len(frame)


def test_settings_have_no_trailing_zeros_without_a_number_of_digits() -> None:
    frame = pd.DataFrame({"frequency_hz": [275.0], "bias_pressure_pa": [6e5], "flow": [1.1304], "ratio": [0.7]})
    table = html_table(frame, ("frequency_hz", "bias_pressure_pa", "flow", Column("ratio", digits=2)), "Settings.")
    assert "".join(f'<td class="number">{cell}</td>' for cell in ("275", "0.6", "1.130", "0.70")) in table
