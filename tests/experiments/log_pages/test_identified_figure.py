"""What stands above the parts of the figure of an identified model."""

from experiments.log_pages.identified_figure import _chance


def test_no_probability_is_written_as_nothing() -> None:
    assert [_chance(one) for one in (0.0, 9e-4, 0.02, 1.0)] == ["p < 0.001", "p < 0.001", "p = 0.02", "p = 1"]
