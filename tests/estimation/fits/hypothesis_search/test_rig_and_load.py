"""A load on a rig whose file has pump and chambers wrong: three things at once."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks.diagnosis.rig_draws import draw_bench, wrong_file
from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log_traits import LogTraits
from estimation.fits.hypotheses import BEGUN, DELIVERY, VOLUME
from estimation.fits.hypothesis_search import explain
from estimation.log_checks.clean import clean_log

sought = explain._rig_and_load  # pyright: ignore[reportPrivateUsage]


@pytest.mark.slow
def test_a_wrong_pump_wrong_chambers_and_a_load_are_found_together() -> None:
    bench = draw_bench(1307)  # a sine of 11 s; the file's chambers are 10 % too small, pump over area 2 %
    rig = wrong_file(bench.healthy, 1307)
    clean = clean_log(bench.record, rig)
    fit = fit_flow(clean.record, rig, rig.bulk_modulus, {}, clean.variances, LogTraits(loaded=True))
    assert fit.explanation is not None
    assert not fit.reasons
    assert set(fit.explanation.names) == {"delivery", "volume", "start_load"}
    found, std = fit.parameters["bulk_modulus"]
    assert abs(found - bench.true.bulk_modulus) < 3.0 * std
    delivered = fit.explanation.values["pump_displacement"][0] / rig.piston_area
    assert delivered == pytest.approx(bench.true.pump_displacement / bench.true.piston_area, rel=1e-3)


def test_the_three_are_sought_together_only_where_nothing_explains_a_log_and_told_only_if_they_do(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    log, spared, asked = np.zeros(3), SimpleNamespace(starts=[{}], every=1), []
    best, three = (SimpleNamespace(void=False, fits=("fit",), fit=cost, cost=cost) for cost in (40.0, 1.0))

    def screened(_: Any, together: Any, *__: Any, **___: Any) -> Any:
        asked.append(together)
        return [three]

    monkeypatch.setattr(explain, "screen", screened)
    monkeypatch.setattr(explain, "likeliest", lambda _, tried, **__: tried[0])

    def found(most: float) -> Any:
        given: Any = log, BEGUN, best, spared, lambda fit: fit <= most
        return sought(*given)

    assert found(50.0) == []
    assert asked == []
    assert found(2.0) == [three]
    assert found(0.5) == []
    assert asked == 2 * [(DELIVERY, VOLUME, BEGUN)]
