import numpy as np
import pytest

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.hypothesis_search.form_fit import TEMPER, likelihood_mean
from estimation.models.flow import FLOW_FORM

NAME = "bulk_modulus"


def found(value: float, cost: float) -> GreyBoxFit:
    return GreyBoxFit(FLOW_FORM, np.zeros(1), {NAME: value}, {NAME: 1.0}, cost, (1.0,), (0.0,))


def test_disagreement_between_two_equally_good_forms_is_in_the_deviation() -> None:
    values = likelihood_mean([found(100.0, 50.0), found(104.0, 50.0)])
    assert values[NAME] == pytest.approx((102.0, 5.0**0.5))


def test_a_form_that_explains_the_log_less_well_has_less_weight() -> None:
    means = [
        likelihood_mean([found(100.0, 50.0), found(104.0, 50.0 + worse)])[NAME][0] for worse in (TEMPER, 1e3 * TEMPER)
    ]
    assert means == pytest.approx([100.0 + 4.0 / (1.0 + np.e), 100.0])


def test_the_weight_of_a_form_is_its_prior_times_its_likelihood() -> None:
    fits = [found(100.0, 50.0), found(104.0, 52.0)]
    assert likelihood_mean(fits, 2.0, [1.0, np.e])[NAME][0] == pytest.approx(102.0)
