import numpy as np
import pytest

from estimation.fits.greybox.driven import driven_samples

SINE = np.sin(np.linspace(0.0, 60.0, 6000))


def test_a_log_that_is_driven_from_its_first_sample_keeps_the_requested_length() -> None:
    assert driven_samples(SINE, 1000) == 1000
    assert driven_samples(np.zeros(50), 1000) == 1000


@pytest.mark.parametrize("rest", [2000, 9000])
def test_the_beginning_extends_past_rest_until_it_has_half_of_the_average_drive(rest: int) -> None:
    drive = np.concatenate([np.zeros(rest), SINE])
    length = driven_samples(drive, 1000)
    average = 1000.0 * np.mean(drive**2)
    assert np.sum(drive[:length] ** 2) >= 0.5 * average > np.sum(drive[: length - 1] ** 2)


def test_missing_speeds_do_not_count_as_driven() -> None:
    gapped = np.concatenate([np.full(3000, np.nan), SINE])
    assert driven_samples(gapped, 1000) == driven_samples(np.nan_to_num(gapped), 1000) > 3000
