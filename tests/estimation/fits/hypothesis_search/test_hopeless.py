"""If no single hypothesis reduces a misfit, no pairs are tried."""

import numpy as np
import pytest

from estimation.fits.flow.belief import hopeless_cost
from estimation.fits.flow.fit import fit_flow
from estimation.fits.hypotheses import HYPOTHESES
from estimation.fits.hypothesis_search import explain
from tests.estimation.fits.short_logs import PAPER, PRESSURE, log, made_fit


@pytest.mark.slow
def test_no_pairs_are_tested_on_a_log_with_varying_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> None:
        raise AssertionError("no two explain what none alone takes any of")

    calm = log(0.5)
    noise = np.random.default_rng(5).normal(0.0, 2e4, len(calm))
    noise[np.arange(len(calm)) % 7 > 0] = 0.0
    monkeypatch.setattr(explain, "_hypothesis_pairs", never)
    assert fit_flow(calm.replace(**{PRESSURE: calm[PRESSURE] + noise}), PAPER, PAPER.bulk_modulus).reasons


@pytest.mark.parametrize(("chi", "cost"), [(2.0, 9_950.0), (1.01, 9_990.0), (0.9, 9_990.0)])
def test_pairs_are_tested_only_if_the_best_hypothesis_removes_a_hundredth_of_the_misfit(
    chi: float, cost: float
) -> None:
    plain = made_fit(1e4, 2e8, 1e5, chi=chi)
    assert hopeless_cost(plain, HYPOTHESES) == pytest.approx(cost)
    assert hopeless_cost(plain, HYPOTHESES[:3]) == np.inf  # the other hypotheses are only tried in pairs
