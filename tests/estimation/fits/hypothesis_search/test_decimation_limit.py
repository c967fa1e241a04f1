"""A decimated log is only used if it costs the same as the whole log."""

from dataclasses import replace
from typing import Any

import pytest

from estimation.fits.flow.log import flow_log, without_strays
from estimation.fits.flow.search import flow_starts
from estimation.fits.hypothesis_search import explain
from estimation.fits.hypothesis_search.decimation import SHORT_LOG, cost_over_noise, decimation_for
from estimation.fits.hypothesis_search.decimation_limit import decimation_limit
from estimation.fits.hypothesis_search.wide_log import widened_log
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.estimation.fits.flow.test_other_rigs import PAPER, STIFF, log


def kept(record: Record, p: EhaParameters, every: int) -> int:
    """Return how many samples may be merged into one at the start of the search for a healthy actuator."""
    cleaned, variances = without_strays(record)
    return decimation_limit(
        widened_log(flow_log(cleaned, p, {}, variances), p), flow_starts(p, p.bulk_modulus)[0], every
    )


def test_steps_of_4_ms_are_allowed_on_the_papers_rig_and_not_in_small_stiff_chambers() -> None:
    assert kept(log(PAPER, 1.0, 1e-3, duration=1.0), PAPER, 4) == 4
    assert kept(log(STIFF, 1.0, 1e-3, duration=1.0), STIFF, 4) < 4


class AskedError(Exception):
    """Raised by a search that should not run."""


def test_hypotheses_are_compared_on_a_log_decimated_as_far_as_the_rig_allows(monkeypatch: pytest.MonkeyPatch) -> None:
    record, variances = without_strays(log(STIFF, 1.0, 5e-4, duration=4.1))
    told = replace(STIFF, pump_displacement=1.05 * STIFF.pump_displacement)
    seen_by_form = flow_log(record, told, {}, variances)
    start = flow_starts(told, STIFF.bulk_modulus)[0]
    wide = widened_log(seen_by_form, told, start)
    assert len(wide.drives) >= SHORT_LOG

    def asked(*given: Any) -> None:
        raise AskedError(given[4].every)

    monkeypatch.setattr(explain, "_single_hypotheses", asked)
    with pytest.raises(AskedError) as found:
        explain.explain(seen_by_form, told, [start], lambda _: False)
    left = cost_over_noise(wide, explain._plain_point(wide, start).cost)  # pyright: ignore[reportPrivateUsage]
    assert found.value.args[0] < decimation_for(wide, left)
