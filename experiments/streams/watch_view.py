"""A watch on a terminal: how near each balance is to an alarm, the channels' readings, the last events."""

import math
import sys
import time
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from experiments.command.visible_text import visible
from experiments.streams.watched import Watched

if TYPE_CHECKING:
    from rich.console import Console, Group

EVENTS = 8
"""Number of events shown [count]."""

REDRAW_RATE = 4
"""Redraw rate of the view [1/s]."""

CALM, NEAR = 0.5, 0.8
"""Shares of an alarm's threshold below which a bar is green, and yellow [fraction]."""

BAR = 30
"""Length of a bar [characters]."""


UNITS: Mapping[str, tuple[str, float]] = {
    "_rad_s": ("rpm", 30.0 / math.pi),
    "_m_s": ("mm/s", 1e3),
    "_m": ("mm", 1e3),
    "_pa": ("bar", 1e-5),
}
"""Endings of channel names: the unit shown, and the factor from SI."""


@contextmanager
def show_view(told: Watched, console: "Console | None" = None) -> Generator[None]:
    """Show a watch on standard error during this block.

    Parameters
    ----------
    console : Console, optional
        Output to use instead.
    """
    from rich.console import Console
    from rich.live import Live

    console = console or Console(stderr=True)
    with Live(get_renderable=lambda: view_frame(told), console=console, refresh_per_second=REDRAW_RATE):
        yield


def lines_wanted(view: bool) -> bool:
    """Return whether JSON lines are written; they are not if a view uses the same terminal."""
    return not (view and sys.stdout.isatty())


def view_frame(told: Watched) -> "Group":
    """Return one frame of the view of a watch."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    state = told.state()
    gauges = state["gauges"]
    lines: list[Any] = [Text(f"{visible(state['name'])}: {_status_line(state, told.alarms)}", style="bold")]
    if gauges is not None:
        balances = Table("balance", "towards an alarm", "[%]", box=None)
        for name, score in gauges["scores"].items():
            balances.add_row(name, *_bar(score, gauges["thresholds"][name], gauges["unlearnt_s"]))
        channels = Table("channel", "now", "unit", box=None)
        for name, value in gauges["values"].items():
            channels.add_row(*_reading(name, value))
        lines += [balances, channels]
    events = [one for one in list(told.last_events) if one["event"] != "alive"][-EVENTS:]
    lines += [
        Text(
            f"{one['clock'][11:19]} UTC  {one['event']}: {visible(str(one['message']))}",
            style="bold red" if one["event"] == "alarm" else "",
        )
        for one in events
    ]
    return Group(*lines)


def _reading(channel: str, value: float | None) -> tuple[str, str, str]:
    """Return name, reading and unit of a channel, as in the server's live view."""
    ending = next((one for one in UNITS if channel.endswith(one)), "")
    unit, factor = UNITS.get(ending, ("", 1.0))
    words = channel.removesuffix(ending).replace("_", " ")
    return words, "-" if value is None else f"{factor * value:.4g}", unit


def _status_line(state: Mapping[str, Any], alarms: int) -> str:
    gauges = state["gauges"]
    counted = f"{alarms} alarm" if alarms == 1 else f"{alarms} alarms"
    if gauges is None:
        return f"{state['state']}, {counted}"
    silent = max(time.time() - gauges["received"], 0.0)
    said = f"{state['state']}, {gauges['time_s']:.1f} s of the stream, {gauges['rows']} rows, {counted}"
    return said if silent < 1.0 else f"{said}, no row for {silent:.0f} s"


def _bar(score: float, threshold: float | None, unlearnt: float) -> tuple[Any, str]:
    """Return a bar of a score relative to its threshold, and the share in percent; while learning, the time left."""
    from rich.text import Text

    if not threshold:
        more = f", {math.ceil(unlearnt)} s more of motion" if unlearnt else ""
        return Text(f"still learning{more}", style="dim"), "-"
    share = min(max(score / threshold, 0.0), 1.0)
    colour = "green" if share < CALM else "yellow" if share < NEAR else "red"
    return Text("#" * round(BAR * share), style=colour) + Text("." * (BAR - round(BAR * share))), f"{100.0 * share:.0f}"
