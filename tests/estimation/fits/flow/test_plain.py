"""Starts of a new fit of a log, once it is known what explains it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from estimation.fits.flow.plain import FitStart, fills_within_a_step, quieter_start
from plant.eha.model import EhaParameters

START = FitStart(EhaParameters(), 2e8)


@pytest.mark.parametrize(("shrunk", "quick"), [(1.0, False), (10.0, False), (100.0, True)])
def test_valves_of_usual_size_fill_the_chambers_of_small_rigs_within_a_step(shrunk: float, *, quick: bool) -> None:
    small = replace(EhaParameters(), chamber_volume=EhaParameters().chamber_volume / shrunk)
    assert fills_within_a_step(small) is quick


@pytest.mark.parametrize(
    ("heard", "walk", "again"),
    [(1e11, 1e12, True), (4e8, 1e12, True), (2.5e8, 1e12, False), (1e8, 1e12, False), (1e11, 1e9, False)],
)
def test_a_log_is_fitted_again_if_its_noise_was_that_of_far_stiffer_oil(heard: float, walk: float, again: bool) -> None:
    plain: Any = SimpleNamespace(
        start=START,
        swinging=SimpleNamespace(values={"bulk_modulus": heard}),
        log=SimpleNamespace(noise=(SimpleNamespace(variance=1e8, walk=walk),), sample_time=1e-3, block=5e-3),
    )
    strange: Any = SimpleNamespace(values={"bulk_modulus": 2e8})
    start = quieter_start(plain, strange)
    assert (start is not None) == again
    assert start is None or start.stiffest == 2e8
    plain.start = replace(START, stiffest=2e8)
    assert quieter_start(plain, strange) is None
