import numpy as np
import pytest
from scipy.special import chdtri

from faults.watch.events import INTERVAL_DROP, change_time


def test_the_change_time_is_the_start_of_the_raised_scores() -> None:
    scores = np.concatenate([np.full(12, 3.0), np.zeros(40)])
    found, (least, most) = change_time(scores)
    assert found == 12
    assert least <= 12 <= most


def test_the_change_time_maximizes_the_likelihood_and_its_interval_contains_similar_ones() -> None:
    scores = np.random.default_rng(3).standard_normal(60)
    scores[:9] += 1.5
    gains = []
    for n in range(1, 61):  # twice the gain in log-likelihood from a raised mean of the last n scores
        risen = scores[:n] - max(np.mean(scores[:n]), 0.0)
        gains.append(scores[:n] @ scores[:n] - risen @ risen)
    found, (least, most) = change_time(scores)
    assert found == int(np.argmax(gains)) + 1
    likely = np.flatnonzero(np.array(gains) >= max(gains) - 2.0 * INTERVAL_DROP) + 1
    assert (least, most) == (likely[0], likely[-1])
    assert most > least


def test_the_limit_of_the_95_percent_interval_follows_from_chi_square() -> None:
    assert pytest.approx(0.5 * float(chdtri(1, 0.05)), abs=1e-3) == INTERVAL_DROP
