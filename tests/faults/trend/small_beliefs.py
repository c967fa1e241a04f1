"""A grid of one setting, and a belief that one log moves, for tests that know what must come of them."""

from dataclasses import fields

import numpy as np

from faults.trend.kalman import GROSS, Belief, Settings, predict
from faults.trend.kalman_loops import take_in


def one_setting(**values: float) -> Settings:
    """Return a grid of one setting; what is not told is 0."""
    return Settings(*(np.array([values.get(field.name, 0.0)]) for field in fields(Settings)))


def next_belief(now: Belief, step: float, value: float, std: float, grid: Settings) -> Belief:
    """Return what is believed after one further log, which a series takes in with all others."""
    found = predict(now, step, grid)
    evidence = now.evidence.copy()
    take_in(found.mean, found.covariance, evidence, value, std, GROSS, grid.scatter)
    return Belief(found.mean, found.covariance, evidence)
