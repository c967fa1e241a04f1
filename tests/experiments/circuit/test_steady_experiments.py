"""The circuit shows figures 3, 4, 8 and 9 as Tables 3 and 4 describe them, with the explanation of errata E7."""

import numpy as np
import pandas as pd
import pytest

from experiments.circuit.steady_experiments import (
    FRICTION_SWEEP,
    LEAKAGE_SWEEP,
    friction_refit,
    leakage_refit,
    throttle_curve,
)
from plant.eha.circuit_parameters import CircuitParameters

RIG = CircuitParameters()


def assert_near_what_went_in(table: pd.DataFrame) -> None:
    """Allow one seed to miss an interval, but not by as much again as its half-width."""
    reach = 0.5 * (table["high"] - table["low"])
    assert (abs(table["refitted"] - table["went_in"]) < 2.0 * reach).all()


@pytest.fixture(scope="module")
def velocities() -> pd.DataFrame:
    return throttle_curve(RIG, LEAKAGE_SWEEP)


@pytest.fixture(scope="module")
def pressures() -> pd.DataFrame:
    return throttle_curve(RIG, FRICTION_SWEEP)


def test_the_piston_slows_as_throttle_a_opens(velocities: pd.DataFrame) -> None:
    assert (velocities["velocity_m_s"].diff().dropna() < 0.0).all()


@pytest.mark.parametrize(("volts", "percent", "published"), [(2.0, 71.0, 75.0), (1.75, 53.0, 50.0)])
def test_velocity_at_the_leakage_levels_is_as_errata_e7_says(
    velocities: pd.DataFrame, volts: float, percent: float, published: float
) -> None:
    row = velocities.set_index("throttle_a_v").loc[volts]
    assert row["percent_of_normal"] == pytest.approx(percent, abs=1.0)
    assert row["published_percent"] == published


def test_pressure_rises_as_throttle_b_shuts_and_saturates_at_the_relief_valve(pressures: pd.DataFrame) -> None:
    found = pressures["differential_pressure_pa"].to_numpy()
    assert np.all(np.diff(found) > 0.0)
    assert found[-1] == pytest.approx(RIG.relief_pressure, rel=0.01)
    assert found[-1] - found[-2] < 0.01 * found[-1]


def test_pressure_at_minor_friction_is_as_errata_e7_says(pressures: pd.DataFrame) -> None:
    row = pressures.set_index("throttle_b_v").loc[2.3]
    assert row["percent_of_normal"] == pytest.approx(320.0, abs=4.0)
    assert row["published_percent"] == 200.0


def test_table_3_is_refitted() -> None:
    table = leakage_refit(RIG, np.random.default_rng(1))
    assert len(table) == 6
    assert (abs(table["refitted"] / table["published"] - 1.0) < 0.03).all()
    assert_near_what_went_in(table)


def test_table_4_is_refitted() -> None:
    table = friction_refit(RIG, np.random.default_rng(1))
    assert len(table) == 9
    assert (abs(table["refitted"] / table["published"] - 1.0) < 0.03).all()
    assert_near_what_went_in(table)
