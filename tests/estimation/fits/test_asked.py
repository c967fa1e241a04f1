"""What a log is asked beside the plain form."""

from dataclasses import replace

from estimation.fits.flow_fit import DOUBTED, LARGEST_CHI_SQUARE, _asked
from estimation.fits.hypotheses import HYPOTHESES
from tests.estimation.fits.short_logs import PAPER, log, made_fit, seen


def test_a_fit_that_leaves_more_than_the_noise_of_sensors_is_asked_for_all_that_may_be_strange() -> None:
    """The gate lets it pass: bulk modulus of a single rod was 39 % too low behind it."""
    plain = seen(log(0.2))
    doubted = replace(made_fit(400.0, 2e8, 1e5), chi_square=(0.5 * (DOUBTED + LARGEST_CHI_SQUARE),))
    asked, remarks = _asked(plain, PAPER, doubted, doubted, loaded=False, moving=False)
    assert all(one in asked for one in HYPOTHESES)
    assert not remarks
