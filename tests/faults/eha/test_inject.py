from dataclasses import asdict, fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from faults.conditions import CONDITIONS, Condition, parameters_for
from faults.eha.inject import abrupt_fault, growing_fault, varied_actuator
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError

RIG = EhaParameters(stroke=0.25, accumulator_gas=1e-3)
FAULTY = parameters_for(CONDITIONS["major_leakage_minor_friction"], RIG)
NAMES = [field.name for field in fields(EhaParameters)]
HALF_WIDTHS = {
    "leakage_coefficient": 0.1,
    "flow_bias": 0.1,
    "friction_quadratic": 0.1,
    "friction_linear": 0.1,
    "friction_coulomb": 0.1,
    "bulk_modulus": 0.2,
}


def test_an_abrupt_fault_is_absent_before_its_time_and_full_from_then_on() -> None:
    rows = abrupt_fault(RIG, FAULTY, at=5.0).sample([0.0, 4.9999, 5.0, 10.0])
    before, after = (list(asdict(p).values()) for p in (RIG, FAULTY))
    np.testing.assert_array_equal(rows, [before, before, after, after])


def test_a_growing_fault_rises_linearly_from_none_to_full() -> None:
    rows = growing_fault(RIG, FAULTY, start=2.0, end=6.0).sample([0.0, 3.0, 8.0])
    column = NAMES.index("friction_linear")
    quarter = RIG.friction_linear + 0.25 * (FAULTY.friction_linear - RIG.friction_linear)
    np.testing.assert_allclose(rows[:, column], [RIG.friction_linear, quarter, FAULTY.friction_linear])


def test_air_ingress_lowers_the_bulk_modulus_alone() -> None:
    path = growing_fault(RIG, replace(RIG, bulk_modulus=0.5e8), start=0.0, end=1.0)
    first, last = path.sample([0.0, 1.0])
    assert [name for name, a, b in zip(NAMES, first, last, strict=True) if a != b] == ["bulk_modulus"]
    assert last[NAMES.index("bulk_modulus")] == 0.5e8


@pytest.mark.parametrize("at", [0.0, -1.0, np.nan, np.inf])
def test_an_abrupt_fault_without_a_positive_time_is_refused(at: float) -> None:
    with pytest.raises(HydrostateError, match="must come at a positive time"):
        abrupt_fault(RIG, FAULTY, at)


@pytest.mark.parametrize(("start", "end"), [(2.0, 2.0), (3.0, 1.0), (np.nan, 1.0), (0.0, np.inf)])
def test_a_fault_that_ends_growing_before_it_starts_is_refused(start: float, end: float) -> None:
    with pytest.raises(HydrostateError, match="must end after it starts"):
        growing_fault(RIG, FAULTY, start, end)


@given(seed=st.integers(0, 2**32 - 1), condition=st.sampled_from(list(CONDITIONS.values())))
@settings(max_examples=50)
def test_spread_stays_within_its_widths_and_keeps_geometry_and_pump(seed: int, condition: Condition) -> None:
    nominal = parameters_for(condition, RIG)
    drawn = varied_actuator(nominal, np.random.default_rng(seed))
    for name, value in asdict(nominal).items():
        assert abs(getattr(drawn, name) - value) <= HALF_WIDTHS.get(name, 0.0) * (1.0 + 1e-12) * abs(value)


def test_spread_draws_are_uniform_and_independent() -> None:
    rng = np.random.default_rng(1)
    ratios = np.array(
        [
            [getattr(p, n) / getattr(RIG, n) for n in HALF_WIDTHS]
            for p in (varied_actuator(RIG, rng) for _ in range(2000))
        ]
    )
    deviations = np.array(list(HALF_WIDTHS.values())) / np.sqrt(3.0)
    np.testing.assert_allclose(ratios.std(axis=0), deviations, rtol=0.05)
    assert np.max(np.abs(np.corrcoef(ratios.T) - np.eye(len(HALF_WIDTHS)))) < 0.1


def test_a_narrower_spread_does_not_change_the_draws_of_the_others() -> None:
    wide = varied_actuator(FAULTY, np.random.default_rng(7))
    narrow = varied_actuator(FAULTY, np.random.default_rng(7), leakage=0.0)
    assert (narrow.leakage_coefficient, narrow.flow_bias) == (FAULTY.leakage_coefficient, FAULTY.flow_bias)
    assert (narrow.friction_coulomb, narrow.bulk_modulus) == (wide.friction_coulomb, wide.bulk_modulus)


@pytest.mark.parametrize("width", [-0.1, 1.0, np.nan])
def test_a_spread_that_could_change_a_sign_is_refused(width: float) -> None:
    with pytest.raises(HydrostateError, match="bulk_modulus spread must be at least 0 and below 1"):
        varied_actuator(RIG, np.random.default_rng(0), bulk_modulus=width)
