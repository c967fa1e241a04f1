"""The page of one actuator: the trend of each severity over its logs, and when it reaches a limit."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
from markupsafe import Markup, escape

from estimation.finding import interval_95
from experiments.fleet.actuators import ActuatorRow
from experiments.fleet.outlook import REACHED, Outlook, outlook_of
from experiments.fleet.page import IF_RIG_RIGHT, finding_text, no_verdict_since, worst_severity_text
from experiments.fleet.rows import STATES, LogRow
from experiments.fleet.to_do import what_to_do
from experiments.page.charts import Charts
from experiments.page.names_shown import QUANTITY_NAMES
from experiments.page.numbers import MISSING, decimals_of, fixed, number, shop_unit
from experiments.page.panels import Curve, Mark, Panel
from experiments.page.render import render_page
from experiments.page.sentences import joined_names, whole_dates
from experiments.page.tables import Cell, Column
from faults.trend.kalman import moments, predict, settings
from faults.trend.trend import FEWEST, trends
from plant.arrays import Array

AHEAD, LEAST_AHEAD = 30, 5
"""Largest and smallest number of future logs for which trends are drawn [count]."""

LEAST_DAYS = 8.0
"""Shortest span of logs that gets an axis of dates, since that axis has no hours [day]."""

NORMAL_90 = 1.645
"""Half-width of a 90 % normal interval, in standard deviations."""

ROUNDING = 0.05
"""Growth below this share of its standard deviation is shown as zero [fraction]."""

ROOM = 0.25
"""Margin above and below the logs, the healthy value and the limit in a chart, as a share of their range [fraction]."""

DATE = "date"
"""Label of a date axis."""

MOST_LOGS = 30
"""Number of latest logs that are listed [count]."""

EXACT = Column("exact", "90 % if the rig file is exact", words=whole_dates)
FORECASTS = (
    "severity",
    Column("level", "level of the trend, 95 % interval", words=whole_dates),
    "limit",
    Column("growth", "growth per log"),
    Column("half", "limit reached, 50 % interval", words=whole_dates),
    Column("most", "limit reached, 90 % interval", words=whole_dates),
    EXACT,
    Column("outlook", words=whole_dates),
)
LOGS = (
    Column("log", of_row=lambda row: Cell(_link(row["log"], row["page"]), "name")),
    Column("date", words=lambda date: Cell(date, "name")),
    Column("state", words=lambda state: Cell(STATES[state], f"fleet-{state} name")),
    "found",
    "worst",
)


def actuator_page(row: ActuatorRow, pages: Mapping[str, str], fleet: str = "../index.html") -> str:
    """Return the page of an actuator.

    Parameters
    ----------
    pages : Mapping[str, str]
        Path of each log's page relative to this one, by file, for logs that have a page.
    fleet : str
        Path of the page of all actuators.
    """
    worst = row.outlook
    every = (
        worst if worst and worst.name == name else outlook_of(row.logs, name, row.maintained) for name in QUANTITY_NAMES
    )
    outlooks = [one for one in every if one is not None]
    outlooks.sort(key=lambda one: worst is None or one.name != worst.name)  # the deciding severity comes first
    counted = max((len(one.logs) for one in outlooks), default=0)
    charts = _charts(outlooks, row.name)
    last = [*row.logs][-MOST_LOGS:][::-1]
    with_rig = any(one.has_common_error for one in outlooks)
    facts = {
        "name": row.name,
        "title": f"{row.name}: {STATES[row.state]}{f' ({finding_text(row.last)})' if row.last.between else ''}.",
        "outlook": _sentence(worst) if worst is not None and row.last.has_verdict else _no_verdict_text(row),
        "to_do": what_to_do(row, has_page=row.last.file in pages),
        "log": pages.get(row.last.file),
        "fleet": fleet,
        "apart": _log_spacing(outlooks),
        "forecasts": pd.DataFrame([_forecast(one, row.last) for one in outlooks]),
        "logs": pd.DataFrame(
            [
                (
                    one.file.rsplit("/", 1)[-1],
                    one.named.shown,
                    one.state,
                    finding_text(one),
                    worst_severity_text(one) if one.shows_severities else "",
                    pages.get(one.file, ""),
                )
                for one in last
            ],
            columns=["log", "date", "state", "found", "worst", "page"],
        ),
        "charts": {f"course-{place}": each for place, (_, each) in enumerate(charts)},
        "captions": [caption for caption, _ in charts],
        "began": _restarts(outlooks, row.maintained),
        "counted": counted,
        "with_rig": with_rig,
        "left_out": len(row.logs) - counted,
    }
    columns = [one for one in FORECASTS if with_rig or one is not EXACT]
    return render_page("fleet/actuator.html", facts, {"forecasts": columns, "logs": LOGS}, {})


def _restarts(outlooks: Sequence[Outlook], maintained: Sequence[float]) -> list[str]:
    """Return a sentence for each log at which trends restart."""
    together: dict[str, list[Outlook]] = {}
    for one in outlooks:
        if one.trend.begin > 0:
            together.setdefault(one.logs[one.trend.begin].file, []).append(one)
    said: list[str] = []
    for which in together.values():
        begin = which[0].trend.begin
        log, before = which[0].logs[begin].named, which[0].logs[begin - 1].named
        repaired = any((before.place or 0.0) < one <= (log.place or 0.0) for one in maintained)
        why = "after a repair" if repaired else "after a lasting change"
        names = [QUANTITY_NAMES[one.name] for one in which]
        subject = "Every severity" if len(names) == len(outlooks) else joined_names(names).capitalize()
        verb = "is" if len(names) in (1, len(outlooks)) else "are"
        said.append(f"{subject} {verb} followed from the log of {log.shown or begin + 1} on, {why}.")
    return said


def _sentence(one: Outlook) -> str:
    name, count = QUANTITY_NAMES.get(one.name, one.name).capitalize(), len(one.logs) - one.trend.begin
    if count >= FEWEST:
        return f"{name}{one.in_full}"
    past = f"{one.past}; " if one.past else ""
    there = f"there {'is' if count == 1 else 'are'} {count}{' since the trend restarted' if one.trend.begin else ''}"
    return f"{name}: {past}no forecast yet, since it needs {FEWEST} logs, and {there}"


def _no_verdict_text(row: ActuatorRow) -> str:
    """Return since when there is no verdict, and what the last log shows if the rig file is right."""
    since = no_verdict_since(row)
    worst = f"{worst_severity_text(row.last)} now{IF_RIG_RIGHT}" if row.last.shows_severities and row.last.worst else ""
    said = "; ".join(one for one in (f"no verdict {since}" if since else "", worst) if one)
    return said[:1].upper() + said[1:]


def _log_spacing(outlooks: Sequence[Outlook]) -> str:
    """Return the usual time between logs, in words; empty if dates are missing."""
    days = next((one.days_apart for one in outlooks if one.days_apart is not None), None)
    if days is None:
        return ""
    told = f"{24.0 * days:.2g} h" if days < 1.0 else f"{days:.3g} day{'' if f'{days:.3g}' == '1' else 's'}"
    return f", every {told}"


def _forecast(one: Outlook, newest: LogRow) -> dict[str, str]:
    """Return the cells of a severity; its level is dated if newer logs do not determine it."""
    scale, unit = shop_unit(one.unit)
    level, (growth, growth_std) = one.trend.level[0], one.trend.growth
    below, above = one.trend.level_deviations
    ends = interval_95(scale * level, scale * below)[0], interval_95(scale * level, scale * above)[1]
    decimals = decimals_of(*ends)
    shown, low, high = (fixed(each, decimals) for each in (scale * level, *ends))
    growth, growth_std = (scale * each for each in (growth, growth_std))
    growth = growth if abs(growth) > ROUNDING * growth_std else 0.0
    places = decimals_of(0.0, 5.0 * growth_std, 6)  # one digit of the deviation, or two if the first is 1
    return {
        "severity": QUANTITY_NAMES[one.name],
        "level": f"{shown} {unit} ({low} to {high}){_as_of(one, newest)}",
        "limit": f"{number(scale * one.series.limit, 3)} {unit}",
        "growth": f"{fixed(growth, places)}\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}{fixed(growth_std, places)} {unit}",
        "half": REACHED if one.past else one.when(1, 3, total=True) or MISSING,
        "most": REACHED if one.past else one.when(0, 4, total=True) or MISSING,
        **({"exact": REACHED if one.past else one.when(0, 4) or MISSING} if one.has_common_error else {}),
        "outlook": f"{one.words}{one.doubt}",
    }


def _as_of(one: Outlook, newest: LogRow) -> str:
    last = one.logs[-1]
    return "" if last is newest else f", as of {last.named.shown or 'an earlier log'}"


def _forecast_length(outlooks: Sequence[Outlook]) -> int:
    """Return for how many future logs trends are drawn: until a limit may be reached, if that is within the horizon."""
    ends = [end for one in outlooks for end in one.quantiles or () if end <= AHEAD]
    few = max((len(one.logs) // 4 for one in outlooks), default=0)
    return min(AHEAD, max(LEAST_AHEAD, few, *(math.ceil(end) + 2 for end in ends)))


def _charts(outlooks: Sequence[Outlook], name: str) -> list[tuple[str, Charts]]:
    """Return charts of the severities' trends, each with its caption; severities over the same logs share a figure."""
    ahead = _forecast_length(outlooks)
    together: dict[tuple[float, ...], list[Outlook]] = {}
    for one in outlooks:
        together.setdefault(tuple(one.series.times), []).append(one)
    found: list[tuple[str, Charts]] = []
    for which in together.values():
        x, label = _abscissa(which[0], ahead)
        panels = [_panel(one, x, ahead) for one in which]
        file = name if len(which) == len(outlooks) else "-".join([name, *(one.name for one in which)])
        caption = joined_names([QUANTITY_NAMES[one.name] for one in which]).capitalize()
        found.append((caption, Charts(x, label, panels, file, label, dates=label == DATE)))
    return found


def _panel(one: Outlook, x: Array, ahead: int) -> Panel:
    """Return a panel with the logs of a severity, its level with a 90 % band, and the forecast of both."""
    scale, unit = shop_unit(one.unit)
    count = len(one.logs)
    measured = np.full(len(x), np.nan)
    measured[:count] = scale * one.series.values
    level, std = _course(one, ahead)
    curves = (
        Curve("logs", measured, "black", "dots"),
        Curve("level", scale * level, "blue"),
        Curve("upper end, 90 %", scale * (level + NORMAL_90 * std), "blue", "edge"),
        Curve("lower end, 90 %", scale * (level - NORMAL_90 * std), "blue", "edge"),
    )
    marks = (Mark("y", scale * one.series.limit, "limit"), Mark("x", float(x[count - 1]), "last log"))
    ends = scale * np.array([*one.series.values, one.series.healthy, one.series.limit])
    room = ROOM * float(np.ptp(ends))  # the axis cuts off forecasts beyond this, which would squeeze the logs
    told = (float(ends.min()) - room, float(ends.max()) + room)
    return Panel(QUANTITY_NAMES[one.name], unit, curves, marks, [(2, 3)], told)


def _abscissa(one: Outlook, ahead: int) -> tuple[Array, str]:
    """Return the horizontal positions of past and future logs, with the label of their axis: dates, or else numbers."""
    days, count = one.days_apart, len(one.logs)
    times = one.series.times
    if days is None or np.any(np.diff(times) <= 0.0) or np.ptp(times) < LEAST_DAYS:
        return np.arange(1, count + ahead + 1, dtype=np.float64), "number of the log"
    return np.concatenate([times, times[-1] + days * np.arange(1, ahead + 1)]), DATE


def _link(name: str, page: str) -> Markup:
    return Markup('<a href="{}">{}</a>').format(page, name) if page else escape(name)


def _course(one: Outlook, ahead: int) -> tuple[Array, Array]:
    """Return level and standard deviation after each log and in the forecast, shape (logs + ahead,) each."""
    grid, series = settings(), one.series
    past = segment_levels(one)
    coming = [moments(predict(one.trend.belief, float(step), grid), grid) for step in range(1, ahead + 1)]
    future = [(series.healthy + series.size * mean, abs(series.size) * std) for mean, std in coming]
    level, std = np.array([*past, *future]).T
    return level, std


def segment_levels(one: Outlook) -> list[tuple[float, float]]:
    """Return level and standard deviation after each log, from the logs of its own segment [the severity's unit].

    A lasting change can be told from an outlier only some logs later; until then, the trend follows the earlier level.
    Here the segments are those known after the last log.

    Returns
    -------
    list of tuple of float
        One for each log.
    """
    series, course = one.series, one.course
    begins = sorted({trend.begin for trend in course})
    found: list[tuple[float, float]] = []
    for begin, end in pairwise([*begins, len(course)]):
        which = slice(begin, end)
        part = replace(series, times=series.times[which], values=series.values[which], stds=series.stds[which])
        late = any(each.begin != begin for each in course[which])
        early = [trend.level for trend in trends(part)] if late else []
        found += [each.level if each.begin == begin else early[k] for k, each in enumerate(course[which])]
    return found
