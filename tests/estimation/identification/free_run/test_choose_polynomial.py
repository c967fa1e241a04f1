"""How many products a polynomial model is given: a block's fit that has gone astray does not speak against it."""

from dataclasses import replace

import numpy as np

from estimation.identification.free_run.choose_polynomial import rescued
from estimation.identification.free_run.data import Channels, channels_from, scaled
from estimation.identification.free_run.linear_fit import Form, fit_linear
from estimation.identification.free_run.polynomial_fit import FINAL_STEPS, PolynomialFit, Runs
from estimation.identification.free_run.polynomial_terms import begun


def bilinear() -> Channels:
    """Return 300 samples of y = 0.7 q^-1 y + 0.3 u + 0.2 u y q^-1."""
    rng = np.random.default_rng(1)
    u, y = np.repeat(rng.uniform(-1.0, 1.0, 60), 5), np.zeros(300)
    for t in range(1, 300):
        y[t] = 0.7 * y[t - 1] + 0.3 * u[t - 1] + 0.2 * u[t - 1] * y[t - 1] + 0.01 * rng.normal()
    return scaled(channels_from([u], [y], 0.1, ["u"], "y"))[0]


def with_product(fit: PolynomialFit, product: tuple[int, int], data: Channels) -> PolynomialFit:
    """Return a fit with one product more."""
    terms = np.concatenate([fit.terms, [[*product, -1]]])
    count = fit.terms.shape[0]
    theta = np.concatenate([fit.theta[:count], [0.0], fit.theta[count:]])
    found = Runs(fit.variables, terms, data).fit(theta, FINAL_STEPS)
    assert found is not None
    return found


def test_a_blocks_fit_that_is_clearly_worse_takes_the_products_of_all_data() -> None:
    data = bilinear()
    part = data.without([np.arange(300) >= 200])
    linear = begun(fit_linear(Form(1, (1,), (1,)), data), data)
    assert linear is not None
    right, astray = with_product(linear, (0, 1), data), with_product(linear, (0, 0), part)
    found = rescued(astray, right, part)
    assert found is not None
    assert found.cost < 0.5 * astray.cost
    assert found.variables is astray.variables
    np.testing.assert_array_equal(found.terms, right.terms)
    assert rescued(None, right, part) is not None


def test_a_blocks_own_growth_stays_where_it_is_as_good() -> None:
    data = bilinear()
    part = data.without([np.arange(300) >= 200])
    linear = begun(fit_linear(Form(1, (1,), (1,)), data), data)
    assert linear is not None
    own, whole = with_product(linear, (0, 1), part), with_product(linear, (0, 1), data)
    assert rescued(own, whole, part) is own
    assert rescued(own, replace(whole, theta=0.9 * whole.theta), part) is own
