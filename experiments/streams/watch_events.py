"""Events of a watch, as entries of the JSON contract: start, ready, alarm, change, missing, back, end."""

import time
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from experiments.command.options import PRESSURE
from experiments.streams.missing_channels import MissingChannels

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from faults.watch.events import Alarm, Change, Event
    from faults.watch.watch import Watch


STATES: Mapping[str, str] = {"start": "learning", "ready": "watching", "end": "ended"}
"""State of a watch after an event."""


BALANCES: Mapping[str, str] = {
    "flow": "the piston gets a different share of the pump's flow than before",
    "force": "moving the piston takes a different pressure than before",
    "motion": "the piston follows the pump differently than before",
}
"""Meaning of a change in each balance."""


class WatchEvents:
    """Reports the events of a watch as entries, and counts samples, gaps and alarms for the last event.

    Parameters
    ----------
    say : callable
        Receives the entries of an event: ``event``, ``time_s`` and its own entries.
    """

    def __init__(self, say: Callable[[dict[str, Any]], None]) -> None:
        self._say = say
        self.watch: Watch | None = None
        self.began = 0.0
        self.alarms = self.rows = self.gaps = self.left_out = 0
        self._came = time.monotonic()
        self._missing = MissingChannels()

    def start(self, source: str, watch: "Watch", rig: str, false_alarms: float) -> None:
        """Report the start of a stream.

        Parameters
        ----------
        rig : str
            Name of the rig.
        false_alarms : float
            Rate during healthy, moving operation [1/h].
        """
        self.watch, self.began = watch, watch.last
        about = {"file": source, "rig": rig, "rate_hz": round(1.0 / watch.sample_time, 6)}
        about |= {"balances": list(watch.balances), "false_alarms_per_hour": false_alarms}
        said = f"learning the healthy behaviour: alarms are possible after {watch.unlearnt:.0f} s of motion"
        if self._is_armed:
            said = "the healthy behaviour was learnt before"
        said += f"; without {PRESSURE}" if self._is_blind else ""
        self._line("start", self.began, **about, message=said)
        if self._is_armed:
            self._report_ready(self.began, watch.thresholds)

    @property
    def _is_armed(self) -> bool:
        return self.watch is not None and any(value < float("inf") for value in self.watch.thresholds)

    def _report_ready(self, time: float, thresholds: Sequence[float]) -> None:
        named = dict(zip(self.watch.balances, thresholds, strict=True)) if self.watch else {}
        self._line("ready", time, thresholds=named, message="learning is over, alarms are possible from now on")

    def alive(self) -> None:
        """Report that the watch is alive, how much it has processed and left out, and how long no rows have arrived."""
        time_s = None if self.watch is None else self.watch.last
        silent = round(time.monotonic() - self._came, 3)
        taken = {"samples": self.rows, "left_out": self.left_out}
        self._line("alive", time_s, **taken, silent_s=silent, alarms=self.alarms, message="alive")

    def process_samples(self, channels: "Mapping[str, NDArray[np.float64]]", last: float, gap: bool) -> None:
        """Process samples that the watch has taken: count them and the gaps before them, and tell missing channels.

        Parameters
        ----------
        channels : Mapping[str, ndarray], shape (n,) each
            Samples by channel [SI].
        last : float
            Time of the last sample [s].
        gap : bool
            Whether rows are missing before the samples.
        """
        judged = {name: channels[name] for name in self._judged(channels)}
        for name, since, missing in self._missing.process(judged, last, gap):
            said = f"samples of {name} are missing since {since:.1f} s of the stream, so no alarm is possible"
            if not missing:
                said = f"{name} is back; it was missing from {since:.1f} s of the stream"
            self._line("missing" if missing else "back", last, channel=name, since_s=_rounded(since), message=said)
        self.gaps += gap
        self.rows += max((len(values) for values in channels.values()), default=0)
        self._came = time.monotonic()

    @property
    def _is_blind(self) -> bool:
        """Whether pressure is not watched."""
        return self.watch is not None and "motion" in self.watch.balances

    def _judged(self, channels: "Mapping[str, NDArray[np.float64]]") -> list[str]:
        """Return the channels without which nothing is judged."""
        from plant.log.chamber_pressures import CHAMBERS

        pressures = () if self._is_blind else (PRESSURE,) if PRESSURE in channels else CHAMBERS
        motion = "position_m" if "position_m" in channels else "velocity_m_s"
        return [name for name in ("motor_speed_rad_s", motion, *pressures) if name in channels]

    def nearness(self) -> dict[str, Any]:
        """Return how near each balance is to an alarm.

        Returns
        -------
        dict[str, Any]
            ``scores`` and ``thresholds`` by balance [dimensionless], and ``unlearnt_s``, the motion time still needed
            for learning [s]; empty before the watch starts.
        """
        if self.watch is None:
            return {}
        numbers = {"scores": self.watch.scores, "thresholds": self.watch.thresholds}
        named = {name: dict(zip(self.watch.balances, values, strict=True)) for name, values in numbers.items()}
        return {**named, "unlearnt_s": self.watch.unlearnt}

    def events(self, events: "Sequence[Event]") -> None:
        """Report new events."""
        from faults.watch.events import Alarm, Ready

        for event in events:
            if isinstance(event, Ready):
                self._report_ready(event.time, event.thresholds)
            elif isinstance(event, Alarm):
                self.alarms += 1
                self._line("alarm", event.time, **_alarm(event), message=_alarm_message(event, self._is_blind))
            else:
                lost = dict(zip(("before", "after"), event.lost or (None, None), strict=True))
                about = {
                    "lost_flow_percent": {when: None if one is None else 100.0 * one for when, one in lost.items()},
                    "pressure_change_percent": None if event.pressure is None else 100.0 * event.pressure,
                }
                self._line("change", event.time, **_alarm(event.alarm), **about, message=_reading(event))

    def end(self, outcome: str, message: str) -> None:
        """Report that the stream has ended, and how.

        Parameters
        ----------
        outcome : str
            ``ok``, ``failed`` or ``interrupted``.
        message : str
            The reason. The count of alarms is used if it is empty, and is added after an interruption.
        """
        if self.watch is not None:
            seconds = self.watch.last - self.began
            counted = f"{self.alarms} {'alarm' if self.alarms == 1 else 'alarms'} in {seconds:.1f} s"
            message = f"{message}; {counted}" if outcome == "interrupted" else message or counted
            if outcome == "ok" and not self._is_armed:
                message += "; the stream ended before learning was over, so no alarm was possible"
        time = None if self.watch is None else self.watch.last
        self._line("end", time, outcome=outcome, alarms=self.alarms, left_out=self.left_out, message=message)

    def _line(self, event: str, time_s: float | None, **entries: Any) -> None:
        clock = datetime.now(UTC).isoformat(timespec="milliseconds")
        self._say({"event": event, "time_s": _rounded(time_s), "clock": clock, **entries})


def _rounded(time: float | None) -> float | None:
    """Return a time rounded to the microsecond, the finest resolution of loggers' clocks [s]."""
    return None if time is None else round(time, 6)


def _alarm(alarm: "Alarm") -> dict[str, Any]:
    return {
        "balance": alarm.balance,
        "since_s": _rounded(alarm.since),
        "since_ci95_s": [_rounded(end) for end in alarm.interval],
        "score": alarm.score,
        "threshold": alarm.threshold,
    }


def _alarm_message(event: "Alarm", blind: bool) -> str:
    from faults.watch.events import LOSS_BALANCE

    first, last = event.interval
    if event.balance == LOSS_BALANCE:
        when = f"since about {event.since:.0f} s of the stream (95 % interval {first:.0f} to {last:.0f} s)"
        if blind:
            return (
                f"more speed is lost than warm oil explains, {when}: by a leak, growing friction or a failing encoder"
            )
        return f"leakage has grown by more than warm oil explains, {when}"
    when = f"{event.since:.2f} s of the stream (95 % interval {first:.2f} to {last:.2f} s)"
    return f"the {event.balance} balance changed at {when}: {BALANCES[event.balance]}"


def _reading(event: "Change") -> str:
    if event.lost is None or event.pressure is None:
        return f"without {PRESSURE} the cause of the change is not known: a leak, friction, a load or a failing sensor"
    before, after = (f"{100.0 * one:.0f} %" for one in event.lost)
    return (
        f"flow lost: {before} of the pump's delivery before, {after} after; "
        f"differential pressure at the same velocity: {100.0 * event.pressure:+.0f} %"
    )
