"""Frequency response of a plant from one log, by the method that its input allows."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from estimation.arrays import Array
from estimation.identification.signals.distortion import Distortion, best_linear_approximation
from estimation.identification.signals.local_polynomial import FrequencyResponse, local_polynomial_response
from estimation.identification.signals.period import find_period
from plant.errors import HydrostateError

SETTLING, FEWEST_PERIODS = 1, 2
"""Periods that are left out at the beginning, and least number of periods after them."""

MULTISINE_RESULTS = (
    *("period_samples", "periods", "noise_power", "odd_power", "even_power"),
    *("odd_power_interval", "even_power_interval", "odd_period_for_1_db", "even_period_for_1_db"),
)
"""Results that only a multisine gives, by the names of the JSON contract."""


@dataclass(frozen=True, eq=False)
class MeasuredResponse:
    """A frequency response, and by which method.

    Parameters
    ----------
    method : str
        ``"multisine"`` where the input is periodic, ``"local-polynomial"`` otherwise.
    distortion : Distortion or None
        Levels of noise and distortion, where the input is periodic.
    """

    method: str
    response: FrequencyResponse
    distortion: Distortion | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values: response with the radius of its 95 % circles, and levels a line where they are known."""
        one, told = self.response, self.distortion
        found: dict[str, Any] = {
            "method": self.method,
            "frequency_hz": one.frequency.tolist(),
            "real": one.response.real.tolist(),
            "imag": one.response.imag.tolist(),
            "radius95": one.radius().tolist(),
            **dict.fromkeys(MULTISINE_RESULTS),
        }
        if told is not None:
            levels = {name: told.level(odd=name == "odd_power") for name in ("odd_power", "even_power")}
            found |= {name: level if np.isfinite(level) else None for name, level in levels.items()}
            for name in ("odd", "even"):
                ends = told.level_interval(odd=name == "odd")
                found[f"{name}_power_interval"] = list(ends) if np.isfinite(ends).all() else None
                found[f"{name}_period_for_1_db"] = told.period_wanted(odd=name == "odd")
            found |= {"period_samples": told.period, "periods": told.periods, "noise_power": float(told.noise.mean())}
        return found


def measured_response(u: Array, y: Array, sample_time: float) -> MeasuredResponse:
    """Return the frequency response of one log: by periods if its input is periodic, otherwise for any input.

    Parameters
    ----------
    u, y : ndarray, shape (n,)
        Input and output [any unit].
    sample_time : float
        Seconds between samples [s].

    Raises
    ------
    HydrostateError
        If the output has gaps, or the input tells nothing.
    """
    lost = int(np.count_nonzero(~np.isfinite(y)))
    if lost:
        raise HydrostateError(f"a frequency response needs every sample of the output, got {lost} that are missing")
    period = find_period(u)
    if period is not None and len(u) // period - SETTLING >= FEWEST_PERIODS and period >= 8:
        told = best_linear_approximation(u, y, sample_time, period=period, settling=SETTLING)
        return MeasuredResponse("multisine", told.response, told)
    return MeasuredResponse("local-polynomial", local_polynomial_response(u, y, sample_time))
