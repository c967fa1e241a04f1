"""A grid of one setting, and a belief after one more log, for tests with a known result."""

from dataclasses import fields

import numpy as np

from faults.trend.kalman import CLIP_DEVIATIONS, Belief, Settings, predict
from faults.trend.kalman_loops import update_belief


def one_setting(**values: float) -> Settings:
    """Return a grid of one setting; values that are not given are 0."""
    return Settings(*(np.array([values.get(field.name, 0.0)]) for field in fields(Settings)))


def next_belief(now: Belief, step: float, value: float, std: float, grid: Settings) -> Belief:
    """Return the belief after one more log; in a series, all logs are processed together."""
    found = predict(now, step, grid)
    evidence = now.evidence.copy()
    update_belief(found.mean, found.covariance, evidence, value, std, CLIP_DEVIATIONS, grid.scatter)
    return Belief(found.mean, found.covariance, evidence)
