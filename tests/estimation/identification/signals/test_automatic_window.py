import numpy as np
import pytest

from estimation.identification import LinearModel, automatic_response
from plant.errors import HydrostateError


def test_the_resolution_is_finer_at_a_resonance_than_at_low_frequencies(table6: dict[str, LinearModel]) -> None:
    truth = table6["major_leakage_minor_friction"]
    rng = np.random.default_rng(1)
    u = np.repeat(rng.choice([-1.0, 1.0], 400), 50)
    clean = truth.simulate(u)
    found = automatic_response(u, clean + 0.05 * clean.std() * rng.standard_normal(u.size), 1e-3)
    width = np.broadcast_to(found.resolution_hz, found.frequency_hz.shape)
    assert width[np.abs(found.frequency_hz - 33.0) < 2.0].mean() < 0.8 * width[found.frequency_hz < 4.0].mean()


@pytest.mark.slow
def test_bands_contain_the_true_gain_at_the_resonance_and_below(table6: dict[str, LinearModel]) -> None:
    truth, covered = table6["major_leakage_minor_friction"], []
    for seed in range(40):
        rng = np.random.default_rng([2, seed])
        u = np.repeat(rng.choice([-1.0, 1.0], 400), 50)
        clean = truth.simulate(u)
        found = automatic_response(u, clean + 0.1 * clean.std() * rng.standard_normal(u.size), 1e-3)
        at = [int(np.argmin(np.abs(found.frequency_hz - f))) for f in (1.0, 5.0, 32.4)]
        low, high = found.gain_band()
        gain = np.abs(truth.frequency_response(found.frequency_hz[at]))
        covered.append((low[at] <= gain) & (gain <= high[at]))
    assert (np.mean(covered, axis=0) >= 0.85).all()


def test_a_short_record_is_refused() -> None:
    with pytest.raises(HydrostateError, match="160 samples or more, got 100"):
        automatic_response(np.arange(100.0) % 7, np.arange(100.0) % 5, 1.0)
