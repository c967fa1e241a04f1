"""The peak over frequency is found by hill climbing, with few runs."""

from types import SimpleNamespace

import pytest

from experiments.diaphragm_motor import sweeps
from experiments.diaphragm_motor.study import RIG


@pytest.mark.parametrize(("peak", "most"), [(483.0, 3), (470.0, 4), (441.0, 5), (352.0, 7), (700.0, 7)])
def test_the_search_for_the_peak_makes_few_runs_and_repeats_none(
    monkeypatch: pytest.MonkeyPatch, peak: float, most: int
) -> None:
    tried: list[float] = []

    def run(_: object, frequency: float, __: float) -> SimpleNamespace:
        tried.append(frequency)
        return SimpleNamespace(outlet_flow=2.0 - 1e-4 * (frequency - peak) ** 2)

    monkeypatch.setattr(sweeps, "operate", run)
    assert sweeps._peak(RIG) == pytest.approx((peak, 2.0))  # pyright: ignore[reportPrivateUsage]
    assert len(set(tried)) == len(tried) <= most
