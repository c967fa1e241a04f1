"""A grid of one setting, for tests that know what must come of it."""

from dataclasses import fields

import numpy as np

from faults.trend.kalman import Settings


def one_setting(**values: float) -> Settings:
    """Return a grid of one setting; what is not told is 0."""
    return Settings(*(np.array([values.get(field.name, 0.0)]) for field in fields(Settings)))
