"""Which order and structure a record is given where neither is told."""

import numpy as np
import pytest

from estimation.identification.choose import STRUCTURES, choose_model
from estimation.identification.model.recursion import filtered


@pytest.mark.parametrize("order", [1, 2])
def test_orders_from_one_to_four_are_compared_and_the_one_that_made_the_record_is_taken(order: int) -> None:
    rng = np.random.default_rng(2)
    u = np.repeat(rng.choice([-1.0, 1.0], 150), 8)
    denominator = np.poly([0.9, 0.6][:order])
    y = filtered([0.0, *[0.5] * order], denominator, u) + 0.05 * rng.normal(size=u.size)
    choice = choose_model(u, y, 0.01, delay=1)
    assert choice.orders is not None
    assert choice.structures is not None
    assert list(choice.orders.index) == [1, 2, 3, 4]
    assert list(choice.structures.index) == list(STRUCTURES)
    assert choice.model.denominator.size - 1 == order
    assert choice.model.structure == choice.structures["fit_percent"].idxmax()
