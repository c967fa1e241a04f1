from dataclasses import replace

import numpy as np
import pytest

from plant.eha.drive_limits import check_drive
from plant.eha.model import EhaParameters
from plant.errors import DriveError
from plant.runs import require_frequency, require_positive, sample_count

RIG = EhaParameters()


def test_sample_count_excludes_the_end_point() -> None:
    assert sample_count(10.0, 1e-4) == 100_000
    assert sample_count(0.3, 0.1) == 3


@pytest.mark.parametrize(
    ("duration", "sample_time"), [(0.0, 1e-3), (-1.0, 1e-3), (1.0, 0.0), (np.nan, 1e-3), (1.0, np.inf)]
)
def test_times_that_are_not_positive_are_refused(duration: float, sample_time: float) -> None:
    with pytest.raises(DriveError, match="must be positive and finite"):
        sample_count(duration, sample_time)


@pytest.mark.parametrize("duration", [1e-3, 1e9])
def test_a_signal_of_one_sample_or_of_a_trillion_is_refused(duration: float) -> None:
    with pytest.raises(DriveError, match="must have 2 to 100000000 samples"):
        sample_count(duration, 1e-3)


def test_speed_beyond_the_motors_limit_is_refused_with_limit_and_speed() -> None:
    fast = np.array([0.0, 260.0, -260.0])
    with pytest.raises(DriveError, match=r"within 251\.4 rad/s, got 260 rad/s"):
        check_drive(fast, 1e-3, RIG)


def test_speed_at_the_limit_is_allowed() -> None:
    check_drive(np.array([RIG.motor_speed_limit, -RIG.motor_speed_limit]), 1e-3, RIG)


def test_the_needed_stroke_is_the_range_of_the_displacement() -> None:
    there_and_back = np.repeat([RIG.rated_speed, -RIG.rated_speed], 6000)
    with pytest.raises(DriveError, match=r"needs 0\.2762 m of stroke, the actuator has 0\.25 m"):
        check_drive(there_and_back, 1e-3, RIG)
    check_drive(there_and_back, 1e-3, replace(RIG, stroke=0.28))


def test_twice_the_piston_area_needs_half_the_stroke() -> None:
    steady = np.full(10_000, RIG.rated_speed)
    check_drive(steady, 1e-3, replace(RIG, piston_area=2.0 * RIG.piston_area))
    with pytest.raises(DriveError, match="stroke"):
        check_drive(steady, 1e-3, RIG)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_speed_that_is_not_finite_is_refused_and_located(bad: float) -> None:
    with pytest.raises(DriveError, match=r"must be finite, got (nan|inf) at sample 2"):
        check_drive(np.array([0.0, 1.0, bad]), 1e-3, RIG)


@pytest.mark.parametrize("shape", [(0,), (3, 2), ()])
def test_a_speed_that_is_not_a_row_of_samples_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(DriveError, match="one-dimensional"):
        check_drive(np.zeros(shape), 1e-3, RIG)


def test_a_frequency_at_half_the_sampling_frequency_is_refused() -> None:
    require_frequency("frequency", 499.0, 1e-3)
    with pytest.raises(DriveError, match="below half the sampling frequency 500 Hz, got 500 Hz"):
        require_frequency("frequency", 500.0, 1e-3)


def test_a_refused_number_is_named_with_its_unit() -> None:
    with pytest.raises(DriveError, match=r"amplitude must be positive and finite, got -2\.0 rad/s"):
        require_positive("amplitude", -2.0, "rad/s")
