from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimation.identification import LinearModel

PUBLISHED = Path(__file__).parents[3] / "experiments" / "published" / "eha_table6_transfer_functions.csv"


@pytest.fixture(scope="session")
def table6() -> dict[str, LinearModel]:
    """Return the published transfer functions at the inferred 1 ms (errata E14)."""
    table = pd.read_csv(PUBLISHED).set_index("condition")
    return {
        str(name): LinearModel(
            numerator=row[["b0", "b1", "b2"]].to_numpy(dtype=float),
            denominator=np.array([1.0, row["a1"], row["a2"]], dtype=float),
            sample_time=1e-3,
            input_name="motor_speed_rad_s",
            output_name="velocity_m_s",
        )
        for name, row in table.iterrows()
    }


@pytest.fixture
def binary() -> Callable[..., np.ndarray]:
    """Return a maker of random binary signals at 1200 rpm, each value held for some samples."""

    def make(rng: np.random.Generator, n: int, hold: int = 50) -> np.ndarray:
        return 125.66 * np.repeat(rng.choice([-1.0, 1.0], n // hold + 1), hold)[:n]

    return make


@pytest.fixture(scope="session")
def plant_30hz() -> LinearModel:
    """Return a strictly proper second-order plant, 30 Hz and damping 0.6, held input at 1 ms."""
    radius, angle = np.exp(-0.6 * 0.06 * np.pi), 0.8 * 0.06 * np.pi
    f = np.array([1.0, -2.0 * radius * np.cos(angle), radius**2])
    b = np.array([0.0, 0.52, 0.48]) * f.sum()
    return LinearModel(b, f, 1e-3, "motor_speed_rad_s", "velocity_m_s", delay=1)
