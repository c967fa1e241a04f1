"""Channels with a wrong sign, unit or name are recognised by runs of likely actuators."""

from itertools import combinations

import numpy as np
import pytest

from estimation.piezo_stack.channel_mistakes import channel_mistakes

PHASE = 2.0 * np.pi * 0.01 * np.arange(500)
RUN = {
    "stack_displacement_m": 3e-5 * np.sin(PHASE),
    "stack_force_n": 2e3 * np.sin(PHASE - 0.2),
    "position_m": 1e-5 * np.arange(500),
    "chamber_pressure_pa": 2e6 * np.sin(PHASE - 0.4) ** 3,
}
OTHER = {**RUN, "position_m": 2e-6 * np.arange(500)}


def changed(**factors: float) -> dict[str, np.ndarray]:
    return {name: factors.get(name, 1.0) * values for name, values in RUN.items()}


def test_channels_like_those_of_a_likely_actuator_are_not_accused() -> None:
    assert channel_mistakes(RUN, [OTHER, RUN]) == ()
    assert channel_mistakes(changed(position_m=0.7, stack_force_n=1.4), [RUN]) == ()


@pytest.mark.parametrize(
    ("name", "factor", "unit"),
    [
        ("position_m", 1e3, "mm"),
        ("stack_displacement_m", 1e6, "um"),
        ("stack_force_n", 1e-3, "kN"),
        ("chamber_pressure_pa", 1e-5, "bar"),
        ("chamber_pressure_pa", 1e-6, "MPa"),
        ("chamber_pressure_pa", 1e-3, "kPa"),
    ],
)
def test_a_wrong_unit_and_a_wrong_sign_are_named_together(name: str, factor: float, unit: str) -> None:
    assert channel_mistakes(changed(**{name: factor}), [RUN]) == (f"{name} is in {unit}",)
    assert channel_mistakes(changed(**{name: -factor}), [RUN]) == (f"{name} has the opposite sign and is in {unit}",)
    assert channel_mistakes(changed(**{name: -1.0}), [RUN]) == (f"{name} has the opposite sign",)


def test_a_size_that_no_unit_explains_is_not_named() -> None:
    assert channel_mistakes(changed(stack_force_n=20.0, position_m=-0.1), [RUN]) == ()


def test_two_channels_that_are_swapped_are_named_and_nothing_else() -> None:
    pairs = list(combinations(RUN, 2))
    # the position of a rod that only creeps is not like any other channel
    alike = [pair for pair in pairs if "position_m" not in pair]
    for one, other in alike:
        said = channel_mistakes({**RUN, one: RUN[other], other: RUN[one]}, [RUN])
        assert said == (f"{one} and {other} are swapped",)


def test_a_channel_unlike_any_run_is_not_accused() -> None:
    noise = np.random.default_rng(1).standard_normal(500)
    assert channel_mistakes({**RUN, "stack_force_n": 2e3 * noise, "position_m": np.zeros(500)}, [RUN]) == ()
