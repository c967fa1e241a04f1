"""Charts of the channels of a log."""

import math
from typing import TYPE_CHECKING

from experiments.page.charts import Charts
from experiments.page.panels import Curve, Panel
from plant.log.columns import UNITS, unit_ending

if TYPE_CHECKING:
    from estimation.finding import Finding
    from plant.log.record import Record

MOST_CHANNELS = 8
"""Largest number of channels drawn [count]."""

SHOWN_IN = {"m": ("mm", 1e3), "m/s": ("mm/s", 1e3), "Pa": ("bar", 1e-5), "rad/s": ("rpm", 30.0 / math.pi)}
"""Units used in workshops, and the factor from SI, by SI unit."""


def channel_charts(record: "Record", found: "Finding", stem: str) -> Charts:
    """Return charts of the channels of a log; channels that were used come first.

    Parameters
    ----------
    stem : str
        Start of the file name of a download.

    Returns
    -------
    Charts
        One panel per channel, at most `MOST_CHANNELS`.
    """
    names = [name for name in dict.fromkeys([*found.channels, *record]) if name in record and name in UNITS]
    panels: list[Panel] = []
    for name in names[:MOST_CHANNELS]:
        unit, scale = SHOWN_IN.get(UNITS[name], (UNITS[name], 1.0))
        panels.append(Panel(plain_channel(name), unit, (Curve("measured", scale * record[name], "blue"),)))
    return Charts(record.time, "time [s]", panels, f"{stem}-measured")


def label_of(name: str) -> str:
    """Return the axis label of a channel in SI units; an unknown column keeps its name.

    Examples
    --------
    >>> label_of("motor_speed_rad_s"), label_of("Weg [mm]")
    ('motor speed [rad/s]', 'Weg [mm]')
    """
    return f"{plain_channel(name)} [{UNITS[name]}]" if name in UNITS else name


def plain_channel(name: str) -> str:
    """Return a channel's name without its unit.

    Examples
    --------
    >>> plain_channel("differential_pressure_pa"), plain_channel("pressure_a_pa")
    ('differential pressure', 'pressure A')
    """
    *words, last = name.removesuffix(unit_ending(UNITS[name])).split("_")
    return " ".join([*words, last.upper() if len(last) == 1 else last])
