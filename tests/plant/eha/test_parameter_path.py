from dataclasses import astuple, fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plant.eha.model import EhaParameters
from plant.eha.parameter_path import Growth, ParameterPath
from plant.errors import RigError

HEALTHY = EhaParameters()
AERATED = replace(HEALTHY, bulk_modulus=1.07e8)
NAMES = [field.name for field in fields(EhaParameters)]
BULK_MODULUS = NAMES.index("bulk_modulus")


def test_a_constant_path_is_one_row_in_the_order_of_the_fields() -> None:
    path = ParameterPath.constant(HEALTHY)
    assert path.is_constant
    np.testing.assert_array_equal(path.sample(np.arange(5.0)), np.array([astuple(HEALTHY)], dtype=np.float64))


def test_a_path_between_equal_parameters_is_constant() -> None:
    assert ParameterPath((0.0, 1.0), (HEALTHY, EhaParameters()), "linear").is_constant


def test_a_stepped_path_holds_each_value_until_the_next_time() -> None:
    path = ParameterPath((0.0, 2.0), (HEALTHY, AERATED), "step")
    times = [-1.0, 0.0, np.nextafter(2.0, 0.0), 2.0, 9.0]
    assert path.sample(times)[:, BULK_MODULUS].tolist() == [2.07e8, 2.07e8, 2.07e8, 1.07e8, 1.07e8]


def test_linear_growth_passes_through_the_given_parameters_and_holds_beyond() -> None:
    path = ParameterPath((1.0, 2.0, 4.0), (HEALTHY, AERATED, HEALTHY), "linear")
    found = path.sample([0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0])[:, BULK_MODULUS]
    np.testing.assert_allclose(found, [2.07e8, 2.07e8, 1.57e8, 1.07e8, 1.57e8, 2.07e8, 2.07e8], rtol=1e-14)


@given(time=st.floats(-10.0, 10.0), growth=st.sampled_from(["step", "linear"]))
def test_every_sample_of_a_path_is_a_valid_actuator_between_its_ends(time: float, growth: Growth) -> None:
    worn = replace(HEALTHY, friction_linear=-7.44e3, leakage_coefficient=6e-11)
    (row,) = ParameterPath((0.0, 5.0), (HEALTHY, worn), growth).sample([time])
    unknown = {"stroke": None, "accumulator_gas": None}
    values: dict[str, Any] = {**dict(zip(NAMES, row.tolist(), strict=True)), **unknown}
    sampled = EhaParameters(**values)
    assert worn.friction_linear <= sampled.friction_linear <= HEALTHY.friction_linear
    assert sampled.piston_area == HEALTHY.piston_area


@pytest.mark.parametrize(
    ("times", "count", "message"),
    [
        ((), 0, "got 0 times and 0 parameter sets"),
        ((0.0, 1.0), 1, "got 2 times and 1 parameter sets"),
        ((1.0, 1.0), 2, "finite and increasing"),
        ((0.0, np.nan), 2, "finite and increasing"),
        ((np.nan,), 1, "finite and increasing"),
    ],
)
def test_a_path_without_rising_times_is_refused(times: tuple[float, ...], count: int, message: str) -> None:
    with pytest.raises(RigError, match=message):
        ParameterPath(times, (HEALTHY,) * count)


def test_an_unknown_growth_is_refused() -> None:
    with pytest.raises(RigError, match="growth must be one of step, linear, got 'quadratic'"):
        ParameterPath((0.0,), (HEALTHY,), "quadratic")  # pyright: ignore[reportArgumentType]
