"""Severities on a page: one bar each, with interval, healthy value, and a limit that the reader can change."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal

from estimation.finding import Quantity
from experiments.page.numbers import shop_unit

ROOM = 1.05
"""Length of a bar's scale relative to the largest number on it [dimensionless]."""

LEAST_RANGE = 1e-3
"""Smallest scale length used in the rounding test [any row's unit]."""

ROUNDING = 1e-6
"""Share of a bar's scale below which a number counts as zero [fraction]."""


@dataclass(frozen=True)
class SeverityRow:
    """One severity in the displayed unit; positions on the bar run from 0 to 100.

    Parameters
    ----------
    value, low, high : float
        The severity and its 95 % interval [the row's unit].
    sound : float
        Value of the healthy actuator [the row's unit].
    limit : float or None
        Initial limit, which the reader can change [the row's unit].
    side : str
        ``"below"`` if a value below the limit is bad, else ``"above"``.
    first, last : float
        Ends of the bar's scale [the row's unit].
    """

    name: str
    words: str
    unit: str
    value: float
    low: float
    high: float
    sound: float
    limit: float | None
    side: str
    first: float
    last: float

    def place(self, value: float) -> float:
        """Return the position of a value on the bar.

        Parameters
        ----------
        value : float
            Value of the severity [the row's unit].

        Returns
        -------
        float
            Between 0 and 100 [% of the bar].
        """
        return round(100.0 * min(max((value - self.first) / (self.last - self.first), 0.0), 1.0), 2)

    @property
    def sound_shown(self) -> float:
        """The healthy value; zero if it differs from zero only by rounding [the row's unit]."""
        return self.sound if abs(self.sound) > ROUNDING * max(self.last - self.first, LEAST_RANGE) else 0.0

    @property
    def limit_text(self) -> str:
        """The limit with all significant digits and no exponent; empty if there is none."""
        return "" if self.limit is None else f"{Decimal(f'{self.limit:.3g}'):f}"


def severity_row(name: str, words: str, one: Quantity, sound: float, limit: float | None) -> SeverityRow | None:
    """Return a severity as a row.

    Parameters
    ----------
    one : Quantity
        The severity.
    sound : float
        Value of the healthy actuator [unit of the quantity].
    limit : float or None
        Its limit [unit of the quantity].

    Returns
    -------
    SeverityRow or None
        None if the log does not determine it.
    """
    if one.value is None or one.ci95 is None or not all(map(math.isfinite, (one.value, *one.ci95))):
        return None
    scale, unit = shop_unit(one.unit)
    value, low, high, healthy = (scale * float(each) for each in (one.value, *one.ci95, sound))
    most = None if limit is None else scale * limit
    shown = [0.0, value, low, high, healthy, *([] if most is None else [most])]
    first, last = ROOM * min(shown), ROOM * max(shown)
    side = "below" if name == "bulk_modulus" else "above"
    return SeverityRow(name, words, unit, value, low, high, healthy, most, side, first, last if last > first else 1.0)


def severity_rows(
    found: Mapping[str, Quantity], healthy: Mapping[str, float], limits: Mapping[str, float], words: Mapping[str, str]
) -> list[SeverityRow]:
    """Return the severities that the log determines, as rows.

    Parameters
    ----------
    found : Mapping[str, Quantity]
        Severities by name.
    healthy, limits : Mapping[str, float]
        The values of the healthy actuator, and those at which it stops being sound [each in the same unit].
    words : Mapping[str, str]
        Displayed name of each severity.
    """
    rows = [
        severity_row(name, words.get(name, name.replace("_", " ")), one, healthy.get(name, 0.0), limits.get(name))
        for name, one in found.items()
    ]
    return [row for row in rows if row is not None]
