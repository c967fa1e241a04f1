import numpy as np
import pytest

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.hypothesis_search.form_fit import TEMPER, weighed
from estimation.models.flow import FLOW_FORM

NAME = "bulk_modulus"


def found(value: float, cost: float) -> GreyBoxFit:
    return GreyBoxFit(FLOW_FORM, np.zeros(1), {NAME: value}, {NAME: 1.0}, cost, (1.0,), (0.0,))


def test_what_two_forms_that_explain_a_log_alike_disagree_on_is_in_the_deviation() -> None:
    values = weighed([found(100.0, 50.0), found(104.0, 50.0)])
    assert values[NAME] == pytest.approx((102.0, 5.0**0.5))


def test_a_form_counts_less_the_less_well_it_explains_the_log() -> None:
    means = [weighed([found(100.0, 50.0), found(104.0, 50.0 + worse)])[NAME][0] for worse in (TEMPER, 1e3 * TEMPER)]
    assert means == pytest.approx([100.0 + 4.0 / (1.0 + np.e), 100.0])


def test_what_is_known_of_forms_before_a_log_counts_beside_their_likelihood() -> None:
    fits = [found(100.0, 50.0), found(104.0, 52.0)]
    assert weighed(fits, 2.0, [1.0, np.e])[NAME][0] == pytest.approx(102.0)
