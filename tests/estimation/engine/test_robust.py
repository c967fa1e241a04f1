"""The correction that a large innovation still causes, as a share of the one without robust weighting."""

import pytest

from estimation.engine.robust import DEGREES, HUBER, inflation
from plant.compiled.expression import symbol
from tests.kernels import computed

SIZES = (0.5, 1.0, 2.9, 3.1, 5.0, 40.0)


def factor(robust: str, deviations: float) -> float:
    return computed({"factor": inflation(robust, symbol("ratio"))}, ratio=deviations**2)["factor"]


@pytest.mark.parametrize("size", SIZES)
def test_huber_limits_an_innovation_to_its_threshold(size: float) -> None:
    assert size / factor("huber", size) == pytest.approx(min(size, HUBER))


@pytest.mark.parametrize("size", SIZES)
def test_student_t_keeps_small_innovations_and_discounts_gross_ones(size: float) -> None:
    pull = size / factor("student-t", size)
    assert pull == pytest.approx(size if size <= 1.0 else (DEGREES + 1.0) * size / (DEGREES + size**2))
    assert factor("student-t", 1.0 + 1e-9) == pytest.approx(1.0)
    assert factor("none", size) == 1.0
