import numpy as np
import pytest

from plant.components.bouc_wen import asymmetric_bouc_wen_rate, bouc_wen_rate, power_bouc_wen_rate


@pytest.mark.parametrize("rate", [-3.0, 2.0])
@pytest.mark.parametrize("h", [-1e-6, 2e-6])
def test_the_asymmetric_law_equals_equation_1(rate: float, h: float) -> None:
    alpha, phi = 6e-8, (0.02, 0.003, -0.002, -0.004)
    signs = np.sign(rate * h), np.sign(rate), np.sign(h), 1.0
    printed = rate * (alpha - abs(h) * sum(p * s for p, s in zip(phi, signs, strict=True)))
    assert asymmetric_bouc_wen_rate(rate, h, alpha, *phi) == pytest.approx(printed)


def test_mirrored_signs_give_the_mirrored_loop() -> None:
    given = asymmetric_bouc_wen_rate(2.0, 1e-6, 6e-8, 0.02, 0.003, -0.002, -0.004)
    mirrored = asymmetric_bouc_wen_rate(2.0, -1e-6, -6e-8, 0.02, -0.003, -0.002, 0.004)
    assert mirrored == pytest.approx(-given)


def test_only_the_products_of_gamma_and_delta_with_beta_matter() -> None:
    assert bouc_wen_rate(0.1, 5.0, 5e4, 1e3, 0.8, -1.1) == bouc_wen_rate(0.1, 5.0, 5e4, 2e3, 0.4, -0.55)


@pytest.mark.parametrize("rate", [-3.0, 2.0])
@pytest.mark.parametrize("h", [-20.0, 0.0, 15.0])
def test_the_law_of_any_exponent_is_the_classical_one_at_exponent_1(rate: float, h: float) -> None:
    assert power_bouc_wen_rate(rate, h, 0.3, 0.006, 0.002, 1.0) == pytest.approx(
        bouc_wen_rate(rate, h, 0.3, 1.0, 0.006, 0.002), rel=1e-12
    )


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
def test_the_law_of_any_exponent_saturates_at_its_analytic_limit(exponent: float) -> None:
    most = (0.3 / (0.006 + 0.002)) ** (1.0 / exponent)
    assert power_bouc_wen_rate(1.0, most, 0.3, 0.006, 0.002, exponent) == pytest.approx(0.0, abs=1e-12)


def test_the_law_of_any_exponent_is_odd() -> None:
    one = power_bouc_wen_rate(2.0, 10.0, 0.3, 0.006, 0.002, 1.7)
    assert power_bouc_wen_rate(-2.0, -10.0, 0.3, 0.006, 0.002, 1.7) == -one
