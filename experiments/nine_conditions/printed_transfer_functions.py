"""Table 6 as poles, zeros and gain, with the uncertainty from rounding to four digits (errata E14)."""

from itertools import product
from typing import Any

import numpy as np

from experiments.nine_conditions.transfer_functions import COEFFICIENTS, printed_gain_interval
from experiments.page.frames import cell
from experiments.published import load

_DIGITS = 4


def printed_model(condition: str) -> dict[str, Any]:
    """Return a model of Table 6 as printed, with its uncertainty from rounding (errata E14).

    Returns
    -------
    dict
        Coefficients, poles and zeros with the half widths of their real and imaginary parts over the rounding box, and
        the interval of the gain.
    """
    table = load("transfer_functions").set_index("condition")
    printed = [repr(cell(table, condition, name)) for name in COEFFICIENTS]
    values = np.array([float(text) for text in printed])
    half = 0.5 * 10.0 ** (np.floor(np.log10(np.abs(values))) - (_DIGITS - 1))
    centre = _roots(values)
    corners = [_roots(values + half * np.array(signs)) for signs in product((-1.0, 1.0), repeat=5)]
    reach = {name: _largest_deviation(centre[name], [corner[name] for corner in corners]) for name in centre}
    low, high = printed_gain_interval(printed)
    gain = float(values[:3].sum() / (1.0 + values[3:].sum()))
    return {
        "numerator": values[:3].tolist(),
        "denominator": [1.0, *values[3:].tolist()],
        "poles": pairs(centre["poles"]),
        "pole_half_width": pairs(reach["poles"]),
        "zeros": pairs(centre["zeros"]),
        "zero_half_width": pairs(reach["zeros"]),
        "dc_gain": {"value": gain, "interval": [low, high]},
    }


def _roots(values: np.ndarray) -> dict[str, np.ndarray]:
    def ordered(coefficients: np.ndarray) -> np.ndarray:
        return np.sort_complex(np.roots(coefficients).astype(np.complex128))[::-1]

    return {"poles": ordered(np.concatenate([[1.0], values[3:]])), "zeros": ordered(values[:3])}


def _largest_deviation(centre: np.ndarray, corners: list[np.ndarray]) -> np.ndarray:
    apart = np.array(corners) - centre
    return np.abs(np.real(apart)).max(axis=0) + 1j * np.abs(np.imag(apart)).max(axis=0)


def pair(value: complex) -> list[float]:
    """Return a complex number in JSON form.

    Returns
    -------
    list of float
        Real and imaginary part.
    """
    return [float(value.real), float(value.imag)]


def pairs(values: np.ndarray) -> list[list[float | None]]:
    """Return complex numbers in JSON form.

    Parameters
    ----------
    values : ndarray of complex, shape (n,)
        Complex numbers in any unit.

    Returns
    -------
    list of list
        Real and imaginary part of each; None for a number that is not finite.
    """
    return [[finite_or_none(float(value.real)), finite_or_none(float(value.imag))] for value in values]


def finite_or_none(value: float) -> float | None:
    """Return a number, or None if it is not finite.

    Parameters
    ----------
    value : float
        A number in any unit.

    Returns
    -------
    float or None
        The same number, or None.
    """
    return value if np.isfinite(value) else None
