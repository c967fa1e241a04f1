"""Which of two explanations of a log is believed."""

from estimation.fits.flow.belief import likelier
from estimation.fits.hypothesis_search.explanation import Explanation
from tests.estimation.fits.short_logs import made_fit


def explanation(name: str, cost: float) -> Explanation:
    return Explanation((name,), {}, {}, (made_fit(cost, 2e8, 1e5),), (), 1e6)


def test_gauges_of_unlike_gains_are_told_where_nothing_else_is_as_likely() -> None:
    """Asked beside all others they took up 1.8 of 2 rad/s that a speed was off by."""
    offset, gauges = explanation("pressure_offset", 2585.0), explanation("pressure_sides", 2731.0)
    assert likelier(offset, gauges) is offset
    assert likelier(explanation("delivery", 2731.0), gauges) is not gauges
    assert likelier(explanation("delivery", 2731.1), gauges) is gauges
    assert likelier(None, gauges) is gauges
    assert likelier(offset, None) is offset
    assert likelier(None, None) is None
