"""The correction that a large innovation still causes, as a share of the one without robust weighting."""

import pytest

from estimation.engine.robust import DEGREES, HUBER, inflation
from plant.compiled.expression import symbol
from tests.kernels import computed

SIZES = (0.5, 1.0, 2.9, 3.1, 5.0, 40.0)


def factor(robust: str, deviations: float) -> float:
    return computed({"factor": inflation(robust, symbol("ratio"))}, ratio=deviations**2)["factor"]


@pytest.mark.parametrize("size", SIZES)
def test_an_innovation_pulls_as_far_as_three_deviations_and_no_further(size: float) -> None:
    assert size / factor("huber", size) == pytest.approx(min(size, HUBER))


@pytest.mark.parametrize("size", SIZES)
def test_student_t_believes_what_is_small_and_lets_go_of_what_is_gross(size: float) -> None:
    pull = size / factor("student-t", size)
    assert pull == pytest.approx(size if size <= 1.0 else (DEGREES + 1.0) * size / (DEGREES + size**2))
    assert factor("student-t", 1.0 + 1e-9) == pytest.approx(1.0)
    assert factor("none", size) == 1.0
