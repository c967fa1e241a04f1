"""Rounding error of a printed number."""

import re

from plant.errors import HydrostateError

_LAST_DIGIT = re.compile(r"^-?\d*\.?(\d*)(?:e(-?\d+))?$")


def digits_half(printed: str) -> float:
    """Return half a unit of the last printed digit.

    Parameters
    ----------
    printed : str
        A number as printed, ``,`` between thousands allowed.

    Returns
    -------
    float
        In the number's unit.

    Raises
    ------
    HydrostateError
        If it is no plain number.

    Examples
    --------
    >>> digits_half("3,447.5"), digits_half("4.784e-12"), digits_half("436")
    (0.05, 5e-16, 0.5)
    """
    found = _LAST_DIGIT.match(printed.replace(",", ""))
    if found is None:
        raise HydrostateError(f"a printed number must be digits, a point and an exponent, got {printed!r}")
    decimals, exponent = found.groups()
    return 0.5 * float(f"1e{int(exponent or 0) - len(decimals)}")
