"""Numbers for readers: sensible digits, exponents in multiples of three, superscripts in units."""

import math
import re
from collections.abc import Mapping, Sequence

MISSING = "\N{EN DASH}"
"""Shown in place of a missing number."""

MINUS, TIMES = "\N{MINUS SIGN}", " \N{MULTIPLICATION SIGN} "

SUPERSCRIPTS = str.maketrans("-.0123456789", "⁻·⁰¹²³⁴⁵⁶⁷⁸⁹")

MOST_DIGITS = 4
"""Largest number of digits for a value with an interval [count]; files for programs have all digits."""

PLAIN_FROM, PLAIN_TO = 1e-3, 1e5
"""Magnitudes between which a number is written without an exponent."""

MOST_DECIMALS = 6
"""Largest number of decimals of a number without a power of ten [count]."""

SHOP_UNITS: Mapping[str, tuple[float, str]] = {
    "Pa": (1e-6, "MPa"),
    "m^3/s": (6e4, "L/min"),
    "m^3/(s Pa)": (6e9, "L/(min bar)"),
}
"""By SI unit: the factor to the unit that gauges in a workshop show, and that unit."""


def number(value: float | None, digits: int = 4) -> str:
    """Write a number in engineering notation: exponents in multiples of three, no more digits than requested.

    Parameters
    ----------
    value : float or None
        The number [any unit].

    Returns
    -------
    str
        The number, or a dash if there is none.

    Examples
    --------
    >>> number(4.784e-12), number(2.07e8, 3), number(0.04311), number(0.0), number(None)
    ('4.784 × 10⁻¹²', '207 × 10⁶', '0.04311', '0', '–')
    """
    if value is None or not math.isfinite(value):
        return MISSING
    if value == 0.0:
        return "0"
    leading, _, power = f"{value:.{digits - 1}e}".partition("e")
    rounded, magnitude = float(f"{leading}e{power}"), int(power)
    if PLAIN_FROM <= abs(rounded) < PLAIN_TO:
        return f"{rounded:.{max(0, digits - 1 - magnitude)}f}".replace("-", MINUS)
    exponent = 3 * (magnitude // 3)
    shift = magnitude - exponent
    mantissa = f"{float(leading) * 10.0**shift:.{max(0, digits - 1 - shift)}f}".replace("-", MINUS)
    return f"{mantissa}{TIMES}10{str(exponent).translate(SUPERSCRIPTS)}"


def percent_text(probability: float) -> str:
    """Return a probability in percent; it is never shown as 0 or 100.

    Parameters
    ----------
    probability : float
        Between 0 and 1 [probability].

    Examples
    --------
    >>> percent_text(0.99995), percent_text(0.873), percent_text(0.0)
    ('> 99.9', '87.3', '< 0.1')
    """
    if probability > 0.999:
        return "> 99.9"
    return "< 0.1" if probability < 0.001 else f"{100.0 * probability:.1f}"


def fixed(value: float | None, decimals: int) -> str:
    """Write a number with a fixed number of decimals, for columns that are compared.

    Parameters
    ----------
    value : float or None
        The number [any unit].

    Returns
    -------
    str
        The number, or a dash if there is none; zero has no sign.

    Examples
    --------
    >>> fixed(0.2714, 2), fixed(-0.0002, 2), fixed(None, 2)
    ('0.27', '0.00', '–')
    """
    if value is None or not math.isfinite(value):
        return MISSING
    return f"{round(value, decimals) + 0.0:.{decimals}f}".replace("-", MINUS)


def decimals_of(low: float, high: float, most: int = 3) -> int:
    """Return the decimals that show an interval's width to two digits, but its ends to at most `MOST_DIGITS` digits.

    Parameters
    ----------
    low, high : float
        Ends of the interval [any unit].
    most : int
        Largest number of decimals [count].

    Examples
    --------
    >>> decimals_of(2.05, 2.09), decimals_of(-32.1, 31.2), decimals_of(1.0, 1.0)
    (3, 0, 2)
    >>> decimals_of(28.573, 28.583), decimals_of(1523.2, 1523.9)
    (2, 0)
    """
    wanted = 1 - math.floor(math.log10(high - low)) if high > low else 2
    largest = max(abs(low), abs(high))
    meant = MOST_DIGITS - 1 - math.floor(math.log10(largest)) if largest > 0.0 else most
    return max(min(wanted, meant, most), 0)


def with_equal_decimals(value: float | None, interval: Sequence[float] | None, unit: str) -> list[str]:
    """Return a value and its interval as text, with the number of decimals that the interval justifies.

    Parameters
    ----------
    value : float or None
        The value [``unit``].
    interval : sequence of float or None
        Ends of the interval [``unit``]; None if unknown.

    Examples
    --------
    >>> with_equal_decimals(1.1e-13, [-2.01, 1.92], "N"), with_equal_decimals(2.5e-11, [2.4e-11, 2.6e-11], "m^3/(s Pa)")
    (['0.0', '−2.0', '1.9'], ['25.0 × 10⁻¹²', '24.0 × 10⁻¹²', '26.0 × 10⁻¹²'])
    >>> with_equal_decimals(-4.121e-5, [-3.21e-4, 2.39e-4], "L/(min bar)")
    ['−41 × 10⁻⁶', '−321 × 10⁻⁶', '239 × 10⁻⁶']
    >>> with_equal_decimals(0.15058, [0.15021, 0.15094], "L/(min bar)")
    ['0.1506', '0.1502', '0.1509']
    """
    if value is None or interval is None:
        return [number(value)]
    low, high = interval
    if unit == "%" or PLAIN_FROM <= max(abs(low), abs(high)) < PLAIN_TO:
        decimals = decimals_of(low, high, 3 if unit == "%" else MOST_DECIMALS)
        return [fixed(each, decimals) for each in (value, low, high)]
    if not all(map(math.isfinite, (value, low, high))):
        return [number(value), number(low, 3), number(high, 3)]
    exponent = 3 * math.floor(math.log10(max(abs(low), abs(high)) or 1.0) / 3)
    inside = [each / 10.0**exponent for each in (value, low, high)]
    decimals = decimals_of(inside[1], inside[2])
    power = f"{TIMES}10{str(exponent).translate(SUPERSCRIPTS)}" if exponent else ""
    return [f"{fixed(each, decimals)}{power}" if each else "0" for each in inside]


def exact(value: float) -> str:
    """Write a number exactly as given, for parameters and settings.

    Parameters
    ----------
    value : float
        The number [any unit].

    Returns
    -------
    str
        The shortest decimal number that equals it to ten digits, with exponents in multiples of three.

    Examples
    --------
    >>> exact(1.52e-3), exact(436.0), exact(2.07e8), exact(1e-8)
    ('0.00152', '436', '207 × 10⁶', '10 × 10⁻⁹')
    """
    shown, times, power = number(value, 10).partition(TIMES)
    return (shown.rstrip("0").rstrip(".") if "." in shown else shown) + times + power


def exact_if_short(value: float) -> str:
    """Write a number exactly if three digits suffice: it was then set, not measured.

    Parameters
    ----------
    value : float
        The number [any unit].

    Examples
    --------
    >>> exact_if_short(275.0), exact_if_short(2.345678), exact_if_short(1e-6)
    ('275', '2.346', '1 × 10⁻⁶')
    """
    return exact(value) if math.isclose(value, float(f"{value:.3g}"), rel_tol=1e-12) else number(value)


def reader_unit(unit: str) -> tuple[float, str]:
    """Return the unit in which a quantity is shown: the workshop unit, and percent for shares.

    Returns
    -------
    tuple of float and str
        Factor from SI, and the unit.

    Examples
    --------
    >>> reader_unit("1"), reader_unit("N")
    ((100.0, '%'), (1.0, 'N'))
    """
    return (100.0, "%") if unit == "1" else shop_unit(unit)


def shop_unit(unit: str) -> tuple[float, str]:
    """Return the workshop unit of a severity.

    Returns
    -------
    tuple of float and str
        Factor from SI, and the unit.

    Examples
    --------
    >>> shop_unit("Pa"), shop_unit("L/min"), shop_unit("m^3/s")
    ((1e-06, 'MPa'), (1.0, 'L/min'), (60000.0, 'L/min'))
    """
    return SHOP_UNITS.get(unit, (1.0, unit))


def pretty_unit(unit: str) -> str:
    """Return a unit with exponents as superscripts.

    Examples
    --------
    >>> pretty_unit("N s^2/m^2"), pretty_unit("m^3/(s Pa^0.5)")
    ('N s²/m²', 'm³/(s Pa⁰·⁵)')
    """
    return re.sub(r"\^(-?\d(?:\.\d)?)", lambda power: power[1].translate(SUPERSCRIPTS), unit)
