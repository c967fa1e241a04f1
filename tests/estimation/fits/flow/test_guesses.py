"""Guesses about a start, of which the likeliest is followed."""

import pytest

from estimation.fits.flow.guesses import guesses_about
from estimation.fits.flow.search import flow_starts
from estimation.models.flow import MASS_FLOW_FORM, STIFFNESS
from plant.eha.model import EhaParameters


def test_guesses_cover_the_range_of_the_paper_rigs_faults_above_a_start() -> None:
    p = EhaParameters()
    start = {"leakage_coefficient": 2e-13, "flow_bias": 3e-6, "bulk_modulus": 1e9, "makeup_conductance": 1e-9}
    around = {STIFFNESS: 4e8, **flow_starts(p, 1e9)[0], **start}
    guesses = guesses_about(around, MASS_FLOW_FORM, p)
    found = [MASS_FLOW_FORM.values(guess) for guess in guesses]
    assert len({tuple(one.values()) for one in found}) == len(found) == 45
    assert found[0]["bulk_modulus"] == pytest.approx(0.7e9)
    assert found[-1] == pytest.approx(
        {
            **found[0],
            "leakage_coefficient": 2e-13 + 11.5 * p.leakage_coefficient,
            "flow_bias": 3e-6 + 5.0 * p.flow_bias,
            "bulk_modulus": 1.3e9,
        },
        rel=1e-9,
        abs=0.0,
    )
