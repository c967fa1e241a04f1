from estimation.engine.kalman import belief_symbols, next_state
from estimation.models.eha_forms import ACCELERATION_FORM


def test_a_step_adds_to_each_scaled_state_directly_and_leaves_a_constant_unchanged() -> None:
    mean, _ = belief_symbols(ACCELERATION_FORM)
    *moving, constant = zip(mean, next_state(ACCELERATION_FORM, mean), strict=True)
    assert all(after.operation == "+" and any(one is before for one in after.arguments) for before, after in moving)
    assert constant[0] is constant[1]
