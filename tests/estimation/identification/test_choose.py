"""The order and structure that are chosen for a record if neither is given."""

import numpy as np
import pytest

from estimation.identification.choose import (
    LEAST,
    STRUCTURES,
    choose_model,
    compare_structures,
    held_back_percent,
    split_record,
)
from estimation.identification.fit.output_error import fit_output_error
from estimation.identification.model.recursion import filtered


@pytest.mark.parametrize("order", [1, 2])
def test_orders_from_one_to_four_are_compared_and_the_true_one_is_taken(order: int) -> None:
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


def test_each_experiment_is_split_into_a_fitted_and_a_held_back_part_except_a_short_one() -> None:
    rng = np.random.default_rng(4)
    first, second, short = (rng.normal(size=n) for n in (2 * LEAST, 3 * LEAST, LEAST - 1))
    fitted, kept = split_record([first, second], [-first, -second])
    for whole, early, late in zip((first, second), fitted[0], kept[0], strict=True):
        assert np.array_equal(np.concatenate([early, late]), whole)
        assert late.size == pytest.approx(whole.size / 3.0, abs=1.0)
    assert all(np.array_equal(u, -y) for u, y in zip([*fitted[0], *kept[0]], [*fitted[1], *kept[1]], strict=True))
    fitted, kept = split_record([short, second], [-short, -second])
    assert [one.size for one in fitted[1]] == [short.size, 2 * LEAST]
    assert [one.size for one in kept[1]] == [LEAST]
    fitted, kept = split_record([short, short], [-short, -short])
    assert [one.size for one in (*fitted[0], *kept[0])] == [short.size] * 4


def test_structures_are_compared_on_the_second_of_two_experiments_too() -> None:
    rng = np.random.default_rng(5)
    u = [rng.normal(size=300) for _ in range(2)]
    y = [filtered([0.0, 0.5], [1.0, -0.8], one) + 0.02 * rng.normal(size=one.size) for one in u]
    form = {"n_numerator": 1, "n_denominator": 1, "delay": 1}
    right = compare_structures(u, y, 0.01, form, ("output-error",))["fit_percent"].iloc[0]
    assert right > 90.0
    other = [y[0], filtered([0.0, -0.5], [1.0, -0.8], u[1])]  # a plant that responds with the opposite sign
    assert compare_structures(u, other, 0.01, form, ("output-error",))["fit_percent"].iloc[0] < 50.0


def test_the_held_back_fit_is_good_for_a_constant_plant_and_negative_for_a_changed_one() -> None:
    rng = np.random.default_rng(6)
    u = np.repeat(rng.choice([-1.0, 1.0], 150), 8)
    y = filtered([0.0, 0.5], [1.0, -0.9], u) + 0.05 * rng.normal(size=u.size)
    changed = np.where(np.arange(u.size) < 800, y, -0.5 * y)
    model = fit_output_error(u, y, 0.01, n_numerator=1, n_denominator=1, delay=1)
    held = held_back_percent(model, u, y)
    assert held == pytest.approx(model.fit_percent, abs=2.0)
    worse = held_back_percent(fit_output_error(u, changed, 0.01, n_numerator=1, n_denominator=1, delay=1), u, changed)
    assert worse is not None
    assert worse < 0.0
    assert held_back_percent(model, u[: LEAST - 1], y[: LEAST - 1]) is None
