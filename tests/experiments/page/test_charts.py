"""A chart contains its numbers, a still picture and a table."""

import base64
import json
import re

import numpy as np

from experiments.page.charts import MOST_DRAWN, Charts
from experiments.page.panels import Curve, Mark, Panel


def numbers_of(charts: Charts) -> dict[str, object]:
    (text,) = re.findall(r'class="numbers">(.*?)</script>', charts.html("one", "A caption."), re.DOTALL)
    return json.loads(text)


def two_curves(count: int) -> Charts:
    time = 0.5 + 1e-3 * np.arange(count)
    curves = Curve("measured", np.sin(time)), Curve("fitted <b>", np.cos(time), "orange")
    return Charts(time, "time [s]", [Panel("velocity", "mm/s", curves, [Mark("x", 0.6, "change")])], "run")


def test_a_chart_has_a_still_picture_and_a_table_and_escapes_its_names() -> None:
    html = two_curves(50).html("one", "A caption.")
    assert '<img alt="A caption." src="data:image/svg+xml;base64,' in html
    assert '<th scope="row">velocity, measured</th>' in html
    assert "<b>" not in html


def test_the_still_picture_of_seven_channels_is_wider_than_high() -> None:
    x = np.arange(20.0)
    many = [Panel(f"channel {i}", "m", [Curve("value", x)]) for i in range(7)]
    html = Charts(x, "time [s]", many, "run").html("one", "A caption.")
    (coded,) = re.findall(r"data:image/svg\+xml;base64,([^\"]+)", html)
    drawn = base64.b64decode(coded).decode()
    (size,) = re.findall(r'viewBox="0 0 ([0-9.]+) ([0-9.]+)"', drawn)
    assert float(size[0]) > float(size[1])
    assert all(f"channel {i}" in drawn for i in range(7))


def test_a_uniform_axis_is_stored_as_start_step_and_count() -> None:
    x = numbers_of(two_curves(50))["x"]
    assert isinstance(x, dict)
    assert (x["start"], x["count"]) == (0.5, 50)
    assert abs(x["step"] - 1e-3) < 1e-12


def test_a_long_log_is_stored_on_a_coarser_axis_of_the_same_length() -> None:
    x = numbers_of(two_curves(3 * MOST_DRAWN))["x"]
    assert isinstance(x, dict)
    assert x["count"] <= MOST_DRAWN
    assert abs(x["start"] + x["step"] * x["count"] - (0.5 + 3e-3 * MOST_DRAWN)) < 0.01


def test_a_non_uniform_axis_is_stored_as_values() -> None:
    charts = Charts(np.array([0.0, 1.0, 5.0]), "log", [Panel("leakage", "L/min", [Curve("value", np.ones(3))])], "run")
    x = numbers_of(charts)["x"]
    assert isinstance(x, dict)
    assert "data" in x


def test_a_log_of_twenty_seconds_at_ten_kilohertz_stays_under_three_megabytes() -> None:
    rng = np.random.default_rng(1)
    time = 1e-4 * np.arange(200_000)
    panels = [
        Panel(name, "1", [Curve("measured", np.sin(time) + 0.02 * rng.standard_normal(len(time)))])
        for name in ("speed", "position", "velocity", "pressure")
    ]
    assert len(Charts(time, "time [s]", panels, "run").html("one", "The log.")) < 2.4e6


def test_a_curve_without_values_has_an_empty_row_in_the_table() -> None:
    x = np.arange(20.0)
    curves = [Curve("silent", np.full(20, np.nan)), Curve("half", np.where(x < 10, x, np.nan))]
    html = Charts(x, "time [s]", [Panel("velocity", "mm/s", curves)], "run").html("one", "A caption.")
    rows = re.findall(r"<tr>(.*?)</tr>", html, re.DOTALL)
    cells = {row.split("velocity, ")[1].split("<")[0]: re.findall(r"<td[^>]*>(.*?)</td>", row) for row in rows[1:]}
    assert not any(re.search(r"\d|nan", cell) for cell in cells["silent"])
    assert [float(cell) for cell in cells["half"][:3]] == [0.0, 9.0, 4.5]
