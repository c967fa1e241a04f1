"""The still picture of a chart: well-formed, with gaps at missing values and round ticks."""

import re
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from matplotlib.ticker import MaxNLocator

from experiments.page.panels import Curve, Mark, Panel
from experiments.page.still import MOST_STILL, _ticks, still_picture  # pyright: ignore[reportPrivateUsage]

SVG = "{http://www.w3.org/2000/svg}"


def drawn(values: list[float], *marks: Mark, look: str = "line", x: list[float] | None = None) -> ET.Element:
    places = np.arange(float(len(values))) if x is None else np.array(x)
    panel = Panel(
        "speed <&>", "mm/s", [Curve("a & b", np.array(values), look=look), Curve("c", np.array(values))], marks
    )
    return ET.fromstring(still_picture(places, "time [s]", [panel]))  # noqa: S314 -- our own picture


def path_of(picture: ET.Element, kind: str) -> str:
    return next(one.attrib["d"] for one in picture.iter(f"{SVG}path") if one.get("class") == kind)


def words_of(picture: ET.Element) -> list[str]:
    return [one.text or "" for one in picture.iter(f"{SVG}text")]


def test_a_line_is_broken_where_a_value_is_missing() -> None:
    path = path_of(drawn([0.0, 1.0, np.nan, 3.0, 2.0]), "line")
    assert re.sub(r"[^ML]", "", path) == "MLML"
    assert re.sub(r"[^MLh]", "", path_of(drawn([0.0, np.nan, 3.0], look="dots"), "dots")) == "MhMh"


def test_the_largest_value_is_drawn_highest_and_the_last_at_the_right() -> None:
    points = [
        (float(a), float(b)) for a, b in re.findall(r"[ML](\S+) ([\d.]+)", path_of(drawn([1.0, 9.0, 5.0]), "line"))
    ]
    assert min(points, key=lambda one: one[1]) == points[1]
    assert [one[0] for one in points] == pytest.approx([0.0, 322.0, 644.0], abs=0.1)


def test_marks_at_a_value_and_at_a_place_are_drawn_there_within_the_picture() -> None:
    mark = path_of(drawn([0.0, 1.0], Mark("y", 3.0, "limit")), "mark")
    height = float(re.findall(r"M0 ([\d.]+)H", mark)[0])
    assert 0.0 < height < 10.0
    assert path_of(drawn([0.0, 1.0, 2.0], Mark("x", 1.0, "change")), "mark").startswith("M322.0 0V")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ([0.0, 10.0], ["0", "5", "10"]),
        ([-0.02, 0.02], ["\N{MINUS SIGN}0.02", "0", "0.02"]),
        ([1e5 + 1.0, 1e5 + 5.0], ["100002", "100004"]),
        ([5.0, 5.0], ["5"]),
        ([np.nan, np.nan], ["0.5"]),
    ],
)
def test_ticks_have_distinct_round_values(values: list[float], words: list[str]) -> None:
    found = words_of(drawn(values))
    assert set(words) <= set(found)
    heights = [one for one in found if one.lstrip("\N{MINUS SIGN}").replace(".", "").isdigit()]
    assert len(heights) >= 3


def test_marks_are_labelled_and_the_range_of_an_axis_can_be_set() -> None:
    picture = drawn([0.0, 1.0], Mark("y", 3.0, "limit"), Mark("x", 1.0, "last log"))
    assert {"limit", "last log"} <= set(words_of(picture))
    panel = Panel("force", "N", [Curve("a", np.array([0.0, 1.0]))], ends=(0.0, 1000.0))
    words = words_of(ET.fromstring(still_picture(np.arange(2.0), "log", [panel])))  # noqa: S314 -- our own picture
    assert {"0", "500", "1000"} <= set(words)


def test_the_edges_of_a_band_are_not_in_the_legend() -> None:
    curves = [
        Curve("level", np.ones(3)),
        Curve("to", 2.0 * np.ones(3), look="edge"),
        Curve("from", np.zeros(3), look="edge"),
    ]
    picture = still_picture(np.arange(3.0), "log", [Panel("force", "N", curves, bands=[(1, 2)])])
    words = words_of(ET.fromstring(picture))  # noqa: S314 -- our own picture
    assert "level" in words
    assert not {"to", "from"} & set(words)


def test_a_logarithmic_axis_has_powers_of_ten_at_equal_distances() -> None:
    def picture(x: np.ndarray) -> ET.Element:
        panel = Panel("gain", "dB", [Curve("a", np.ones(x.size))])
        return ET.fromstring(still_picture(x, "frequency [Hz]", [panel], log=True))  # noqa: S314 -- our own picture

    texts = [one for one in picture(np.geomspace(0.5, 2000.0, 50)).iter(f"{SVG}text") if one.get("y") == "111"]
    found = {one.text: float(one.attrib["x"]) for one in texts}
    assert list(found) == ["1", "10", "100", "1000"]
    assert np.diff(list(found.values())) == pytest.approx(644.0 / np.log10(4000.0), abs=0.1)
    assert {"1", "2", "5", "10", "20"} <= set(words_of(picture(np.array([1.0, 30.0]))))


@pytest.mark.parametrize(("days", "step"), [(20.0, 7), (100.0, 28), (4000.0, 1825)])
def test_ticks_of_a_date_axis_are_whole_days_with_labels_that_do_not_overlap(days: float, step: int) -> None:
    x = 20700.0 + np.linspace(0.0, days, 50)
    panels = [Panel("level", "N", [Curve("a", np.ones(50))])] * 5  # five panels are drawn in two columns
    picture = ET.fromstring(still_picture(x, "date", panels, dates=True))  # noqa: S314 -- our own picture
    texts = [one for one in picture.iter(f"{SVG}text") if re.fullmatch(r"\d{4}-\d\d-\d\d", one.text or "")]
    places = {np.datetime64(str(one.text)): float(one.attrib["x"]) for one in texts}
    assert {int(one) for one in np.diff(list(places)).astype(int)} == {step}
    assert min(np.diff(list(places.values()))) >= 70.0


def test_names_are_escaped_and_a_long_log_keeps_its_peak_with_few_points() -> None:
    values = np.zeros(100_000)
    values[77_777] = 1.0
    picture = drawn(values.tolist())
    assert {"speed <&>", "a & b", "time [s]"} <= set(words_of(picture))
    path = path_of(picture, "line")
    assert len(re.findall("[ML]", path)) <= MOST_STILL
    assert min(float(one) for one in re.findall(r"[ML]\S+ ([\d.]+)", path)) < 10.0


def test_ticks_are_at_the_same_values_as_in_matplotlib() -> None:
    rng = np.random.default_rng(3)
    for most in (4, 8):
        for size, where in zip(10.0 ** rng.uniform(-6, 6, 300), rng.uniform(-1.0, 30.0, 300), strict=True):
            low, high = where * size, (where + 1.0) * size
            theirs = MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
            ours = [place for place, _ in _ticks(float(low), float(high), most)]
            assert ours == pytest.approx([one for one in theirs if low <= one <= high], abs=1e-9 * size)
