"""The page of one actuator: how every severity develops over its logs, and when a limit is reached."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from estimation.finding import interval_95
from experiments.fleet.actuators import ActuatorRow
from experiments.fleet.outlook import Outlook, outlook_of
from experiments.fleet.page import found_in
from experiments.fleet.rows import STATES
from experiments.page.charts import Charts
from experiments.page.names_shown import SHOWN
from experiments.page.numbers import MISSING, decimals_of, fixed, number, shop_unit
from experiments.page.panels import Curve, Mark, Panel
from experiments.page.render import render_page
from experiments.page.tables import Cell, Column
from faults.trend.kalman import moments, predict, settings
from faults.trend.trend import FEWEST
from plant.arrays import Array

AHEAD = 30
"""Logs for which the course is drawn on [count]."""

NORMAL_90 = 1.645
"""Half-width of a 90 % normal interval, in standard deviations."""

ROUNDING = 0.05
"""Growth below this share of its standard deviation is shown as none [fraction]."""

ROOM = 0.25
"""Room above and below the logs, the healthy value and the limit in a chart, as a share of their range [fraction]."""

MOST_LOGS = 30
"""Last logs that are listed [count]."""

FORECASTS = (
    "severity",
    Column("level", "level now, 95 % interval"),
    "limit",
    Column("growth", "growth per log"),
    Column("half", "limit reached, 50 % interval"),
    Column("most", "limit reached, 90 % interval"),
    Column("outlook", "outlook"),
)
LOGS = (
    Column("log", words=lambda name: Cell(name, "name")),
    Column("date", words=lambda date: Cell(date, "name")),
    Column("state", words=lambda state: Cell(STATES[state], f"fleet-{state} name")),
    "found",
)


def actuator_page(row: ActuatorRow, log: str | None, fleet: str = "../index.html") -> str:
    """Return the page of an actuator.

    Parameters
    ----------
    log : str or None
        Path of the page of its last log from this one, where there is one.
    fleet : str
        Path of the page of all actuators.
    """
    worst = row.outlook
    every = (worst if worst and worst.name == name else outlook_of(row.logs, name, row.maintained) for name in SHOWN)
    outlooks = [one for one in every if one is not None]
    counted = max((len(one.logs) for one in outlooks), default=0)
    last = [*row.logs][-MOST_LOGS:][::-1]
    facts = {
        "name": row.name,
        "title": f"{row.name}: {STATES[row.state]}{f' ({found_in(row.last)})' if row.last.between else ''}.",
        "outlook": "" if worst is None else _sentence(worst),
        "log": log,
        "fleet": fleet,
        "apart": _apart(outlooks),
        "forecasts": pd.DataFrame([_forecast(one) for one in outlooks]),
        "logs": pd.DataFrame(
            [(one.file.rsplit("/", 1)[-1], one.named.shown, one.state, found_in(one)) for one in last],
            columns=["log", "date", "state", "found"],
        ),
        "charts": {one.name: _chart(one, row.name) for one in outlooks},
        "names": [(one.name, SHOWN[one.name]) for one in outlooks],
        "began": _restarts(outlooks, row.maintained),
        "counted": counted,
        "left_out": len(row.logs) - counted,
    }
    return render_page("fleet/actuator.html", facts, {"forecasts": FORECASTS, "logs": LOGS}, {})


def _restarts(outlooks: Sequence[Outlook], maintained: Sequence[float]) -> list[str]:
    """Return a sentence for each log at which trends start again."""
    together: dict[str, list[Outlook]] = {}
    for one in outlooks:
        if one.trend.begin > 0:
            together.setdefault(one.logs[one.trend.begin].file, []).append(one)
    said: list[str] = []
    for which in together.values():
        begin = which[0].trend.begin
        log, before = which[0].logs[begin].named, which[0].logs[begin - 1].named
        repaired = any((before.place or 0.0) < one <= (log.place or 0.0) for one in maintained)
        why = "after a repair" if repaired else "after a lasting jump"
        names = [SHOWN[one.name] for one in which]
        subject = "Every severity" if len(names) == len(outlooks) else ", ".join(names).capitalize()
        verb = "is" if len(names) in (1, len(outlooks)) else "are"
        said.append(f"{subject} {verb} followed from the log of {log.shown or begin + 1} on, {why}.")
    return said


def _sentence(one: Outlook) -> str:
    name, count = SHOWN.get(one.name, one.name).capitalize(), len(one.logs) - one.trend.begin
    if count >= FEWEST:
        return f"{name}{one.in_full}"
    past = f"{one.past}; " if one.past else ""
    there = f"there {'is' if count == 1 else 'are'} {count}{' since the trend restarted' if one.trend.begin else ''}"
    return f"{name}: {past}no forecast yet, since it needs {FEWEST} logs, and {there}"


def _apart(outlooks: Sequence[Outlook]) -> str:
    """Return how far apart logs usually are, in words; empty where dates do not say."""
    days = next((one.days_apart for one in outlooks if one.days_apart is not None), None)
    if days is None:
        return ""
    told = f"{24.0 * days:.2g} h" if days < 1.0 else f"{days:.3g} day{'' if f'{days:.3g}' == '1' else 's'}"
    return f", {told}"


def _forecast(one: Outlook) -> dict[str, str]:
    scale, unit = shop_unit(one.unit)
    (level, std), (growth, growth_std) = one.trend.level, one.trend.growth
    ends = interval_95(scale * level, scale * std)
    decimals = decimals_of(*ends)
    shown, low, high = (fixed(each, decimals) for each in (scale * level, *ends))
    growth, growth_std = (scale * each for each in (growth, growth_std))
    growth = growth if abs(growth) > ROUNDING * growth_std else 0.0
    places = decimals_of(0.0, 5.0 * growth_std, 6)  # one digit of the deviation, two of one below 0.2 of a digit
    return {
        "severity": SHOWN[one.name],
        "level": f"{shown} {unit} ({low} to {high})",
        "limit": f"{number(scale * one.series.limit, 3)} {unit}",
        "growth": f"{fixed(growth, places)} ± {fixed(growth_std, places)} {unit}",
        "half": one.when(1, 3) or MISSING,
        "most": one.when(0, 4) or MISSING,
        "outlook": one.words,
    }


def _chart(one: Outlook, name: str) -> Charts:
    """Return the logs of a severity, its level with a 90 % band, and the same for `AHEAD` logs to come."""
    scale, unit = shop_unit(one.unit)
    count = len(one.logs)
    x = np.arange(1, count + AHEAD + 1, dtype=np.float64)
    measured = np.full(len(x), np.nan)
    measured[:count] = scale * one.series.values
    level, std = _course(one)
    curves = (
        Curve("logs", measured, "black", "dots"),
        Curve("level", scale * level, "blue"),
        Curve("upper end, 90 %", scale * (level + NORMAL_90 * std), "blue", "edge"),
        Curve("lower end, 90 %", scale * (level - NORMAL_90 * std), "blue", "edge"),
    )
    marks = (Mark("y", scale * one.series.limit, "limit"), Mark("x", float(count), "last log"))
    ends = scale * np.array([*one.series.values, one.series.healthy, one.series.limit])
    room = ROOM * float(np.ptp(ends))  # a forecast that leaves it would leave no height for the logs
    told = (float(ends.min()) - room, float(ends.max()) + room)
    panel = Panel(SHOWN[one.name], unit, curves, marks, [(2, 3)], told)
    return Charts(x, "number of the log", [panel], f"{name}-{one.name}", "logs")


def _course(one: Outlook) -> tuple[Array, Array]:
    """Return level and standard deviation after every log, and as forecast, shape (logs + AHEAD,) each."""
    grid, series = settings(), one.series
    past = [trend.level for trend in one.course]
    ahead = [moments(predict(one.trend.belief, float(step), grid), grid) for step in range(1, AHEAD + 1)]
    future = [(series.healthy + series.size * mean, abs(series.size) * std) for mean, std in ahead]
    level, std = np.array([*past, *future]).T
    return level, std
