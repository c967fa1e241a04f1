from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimation.identification.fit.inverse_dynamics import fit_rigid_body, force_error
from plant.errors import HydrostateError

NEWTONS_PER_VOLT = 35.15065
PUBLISHED = np.array([95.1089, 203.5034, 20.3935])
PUBLISHED_STD = np.array([0.11, 1.15, 0.10])


def test_mass_and_friction_of_a_simulated_body_are_found() -> None:
    time = 1e-3 * np.arange(20_000)
    position = 0.1 * np.sin(3.0 * time) + 0.05 * np.sin(7.0 * time)
    velocity = 0.3 * np.cos(3.0 * time) + 0.35 * np.cos(7.0 * time)
    acceleration = -0.9 * np.sin(3.0 * time) - 2.45 * np.sin(7.0 * time)
    force = 50.0 * acceleration + 100.0 * velocity + 10.0 * np.sign(velocity) + 2.0
    found = fit_rigid_body(position, force, 1e-3)
    np.testing.assert_allclose(found.values, [50.0, 100.0, 10.0, 2.0], rtol=0.01)
    assert found.relative_force_error < 0.01


@pytest.fixture
def emps(shared: Path) -> Path:
    folder = shared / "data" / "emps"
    if not (folder / "train.csv").is_file():
        pytest.skip("the EMPS records are not at hand (HYDROSTATE_SHARED)")
    return folder


def test_the_positioning_system_has_the_published_mass_and_friction(emps: Path) -> None:
    train, pulses = (pd.read_csv(emps / name) for name in ("train.csv", "test_pulses.csv"))
    columns = [(log["position_qm_m"], NEWTONS_PER_VOLT * log["vir_V"]) for log in (train, pulses)]
    found = fit_rigid_body(*columns[0], 1e-3)
    assert (np.abs(found.values[:3] - PUBLISHED) < 2.0 * PUBLISHED_STD).all()
    assert found.relative_force_error <= 0.040
    assert force_error(found, *columns[1], 1e-3) <= 0.050


def test_a_log_without_motion_in_both_directions_is_refused() -> None:
    with pytest.raises(HydrostateError, match="move both ways"):
        fit_rigid_body(np.arange(1_000.0), np.ones(1_000), 1e-3)
    with pytest.raises(HydrostateError, match="of one length"):
        fit_rigid_body(np.arange(1_000.0), np.ones(10), 1e-3)


def test_gaps_and_a_filter_beyond_half_the_sample_rate_are_refused() -> None:
    moving, pushed = np.sin(0.02 * np.arange(1_000.0)), np.ones(1_000)
    with pytest.raises(HydrostateError, match="position and force must have no gaps"):
        fit_rigid_body(np.where(np.arange(1_000) == 3, np.nan, moving), pushed, 1e-3)
    for cutoff in (0.0, 500.0):
        with pytest.raises(HydrostateError, match="cutoff_hz must lie between 0 and 500 Hz"):
            fit_rigid_body(moving, pushed, 1e-3, cutoff_hz=cutoff)
