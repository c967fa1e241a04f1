"""`Watch(...).take(samples)`: detects a change inside an actuator, at a chosen rate of false alarms.

With differential pressure there are two balances: flow (pump delivery and the piston's swept flow, equation 5.8) and
force (pressure, friction and inertia, equation 5.9). Without it one of motion remains. Each raises an alarm if the
CUSUM of its log NIS passes a threshold. They follow slow drift, so a slower test also asks whether the loss exceeds
what warming oil explains (`faults.watch.loss`). All share one rate of false alarms.

The threshold follows from the rate: the CUSUM of a healthy stream rises from zero and returns, and the peaks of these
excursions have an exponential tail whatever the dependence from block to block (Cramér and Lundberg; Asmussen, Applied
Probability and Queues, 2003, chapter XIII.5). Its scale is learnt from the highest peaks so far, about the two-thirds
power of their number, and extrapolated. With scale and count uncertain, the expected rate at a level h above the lowest
of k peaks is ``k (1 + h / (k s))^-k`` (a Pareto predictive law), which is set to the rate that the user chose.
"""

from collections.abc import Mapping
from math import exp

import numpy as np

from faults.watch.balances import GAIN_PP, GAIN_PV, GAIN_QP, GAIN_VV, GAIN_WP
from faults.watch.cusum import SUM, THRESHOLD
from faults.watch.events import LOSS_BALANCE, Alarm, Change, Event, Ready, change_time
from faults.watch.growth import growth_time
from faults.watch.kernel import INTERVALS, LOSS, READY, watch_kernel
from faults.watch.loss import (
    LAST,
    LAST_RESISTANCE,
    LIMIT,
    RESISTANCE,
    RISEN,
    SEEN,
    SHARE,
    SPAN,
    WANTED,
    learn_loss_again,
    loss_threshold,
    oil_allowance,
)
from faults.watch.memory import (
    ALL,
    KEPT_SPANS,
    LEARNT_FROM,
    POSITION,
    RECENT,
    SAMPLES,
    USABLE,
    WHOLE,
    WatchSetting,
    WatchSizes,
    empty_memory,
)
from faults.watch.samples import watched_samples
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError
from plant.log.record import Record

INTERVAL = 5e-3
"""Time over which samples are averaged [s]; one sample if they are further apart."""

SLOWEST = 0.05
"""Longest time between samples that can be watched [s]: at a longer one a reversal can fall between two samples."""

MEMORY = 30.0
"""Fading memory of the balances [s]."""

SCORE_MEMORY = 15.0
"""Fading memory of the mean and deviation of the scores of similarly excited blocks [s]."""

SETTLE = 10.0
"""Time in which the balances learn before their innovations count, and again before their deviation does [s]."""

LEARNING = 120.0
"""Healthy running before alarms can be raised [s]."""

LEAST_LEARNING, MOST_LEARNING = 60.0, 1e7
"""Shortest and longest healthy running that can be set before alarms; judged [s]."""

PAUSE = 60.0
"""Standstill after which the balances are learnt again, as after missing rows: oil has cooled; judged [s]."""

AFTER = 2.0
"""Running time after an alarm from which the change of the gains is determined [s]."""

BUILD_UP = 6
"""Blocks before the first one that shows a change in which it may have come: only a reversal may reveal it."""

BALANCES = ("flow", "force")
"""The balances with differential pressure."""

SLOW_SHARE = 0.05
"""Share of the false alarms that is reserved for slow growth [fraction]; oil that is not thinnest uses none."""


class Watch:
    """Watch a stream; the memory it needs does not grow.

    Parameters
    ----------
    parameters : EhaParameters
        The actuator; only its sizes are used, the balances are learnt.
    sample_time : float
        Time between samples [s].
    false_alarms : float
        Rate of false alarms in a healthy stream [1/h], per hour of motion.
    learning : float
        Healthy running before alarms can be raised [s].
    start : float
        Time of the first sample [s].

    Raises
    ------
    HydrostateError
        If a rate or time is not usable.
    """

    def __init__(
        self,
        parameters: EhaParameters,
        sample_time: float,
        *,
        pressure: bool = True,
        false_alarms: float = 1.0,
        learning: float = LEARNING,
        start: float = 0.0,
    ) -> None:
        if not 0.0 < sample_time <= SLOWEST:
            raise HydrostateError(f"a watch needs a sample at least every {SLOWEST:g} s, got one in {sample_time:g} s")
        if not 0.0 < false_alarms <= 60.0:
            raise HydrostateError(f"false alarms must be over 0 and at most 60 an hour, got {false_alarms:g}")
        if not LEAST_LEARNING <= learning <= MOST_LEARNING:
            raise HydrostateError(f"learning must take {LEAST_LEARNING:g} to {MOST_LEARNING:g} s, got {learning:g} s")
        balances = BALANCES if pressure else ("motion",)
        self.pressure, self.balances = pressure, (*balances, LOSS_BALANCE)
        self.sample_time, self.start = sample_time, start
        samples = max(1, round(INTERVAL / sample_time))
        self.block = samples * INTERVALS
        """Samples in a block."""
        duration = self.block * sample_time
        rated_velocity = parameters.rated_flow / parameters.piston_area
        scales = parameters.rated_speed, rated_velocity * sample_time, parameters.relief_pressure
        fade = exp(-samples * sample_time / MEMORY)
        allowed = false_alarms * duration / 3600.0
        self._setting = WatchSetting(fade, SCORE_MEMORY / duration, (1.0 - SLOW_SHARE) * allowed, *scales)
        settle = round(SETTLE / duration)
        self._sizes = WatchSizes(samples, settle, round(learning / duration), 3 * settle, round(PAUSE / duration))
        self._memory = empty_memory(len(balances), loss_threshold(SLOW_SHARE * SPAN * allowed))
        self._partial, self._clock = self._memory.partial, self._memory.clock
        self._score, self._known = self._memory.score, self._memory.known
        self._open: tuple[Alarm, int, int] | None = None

    @property
    def time(self) -> float:
        """End of the last whole block [s]."""
        return self.start + float(self._clock[ALL]) * self.block * self.sample_time

    @property
    def last(self) -> float:
        """Time up to which samples have been taken [s]."""
        return self.start + self._taken * self.sample_time

    @property
    def unlearnt(self) -> float:
        """Time in motion that is still to be learnt before alarms can be raised [s]; standstill does not count."""
        return max(0.0, self._sizes.learning - float(self._clock[USABLE])) * self.block * self.sample_time

    @property
    def thresholds(self) -> tuple[float, ...]:
        """Thresholds of the balances [dimensionless]; infinite while they are learnt."""
        slow = self._known[LIMIT] if self._known[WANTED] < np.inf else np.inf
        return tuple(float(value) for value in (*self._score[:, THRESHOLD], slow))

    @property
    def scores(self) -> tuple[float, ...]:
        """The CUSUM of each balance [dimensionless]: an alarm is raised if one passes its threshold."""
        return tuple(float(value) for value in (*self._score[:, SUM], self._known[RISEN]))

    def take(self, samples: Array) -> list[Event]:
        """Take samples, one or many; the result does not depend on how the stream is cut into pieces.

        Parameters
        ----------
        samples : ndarray, shape (n, 3)
            Motor speed [rad/s], position [m], differential pressure [Pa]; NaN if missing, and any finite value for a
            pressure that is not logged.

        Returns
        -------
        list of Ready, Alarm or Change
            Events, in order.
        """
        kernel, rows = watch_kernel(), np.ascontiguousarray(samples, dtype=np.float64)
        events: list[Event] = []
        place = 0
        while place < len(rows):
            stop = len(rows)
            if self._open is not None:
                stop = min(stop, place + max(self._open[2] * self.block - self._taken, 1))
            place, news = kernel.advance(rows[:stop], place, self._setting, self._sizes, self._memory)
            if news == READY:
                events.append(Ready(self.time, self.thresholds))
            elif news == LOSS:
                events += self._loss_events()
            elif news >= 0:
                events.append(self._raise_alarm(news))
            if self._open is not None and self._clock[ALL] >= self._open[2]:
                events += self._change_events()
        return events

    def clock_reads(self, time: float) -> None:
        """Set the clock: a stream's own time stamps take precedence over counting its samples.

        Parameters
        ----------
        time : float
            Time of the next sample [s].
        """
        self.start = time - self._taken * self.sample_time

    def interrupt(self) -> None:
        """Declare that the next sample does not follow the last one: another log, or a gap in time."""
        self._clock[ALL] += 1.0 if self._taken > self._clock[ALL] * self.block else 0.0
        self._partial[:] = 0.0
        self._partial[POSITION] = np.nan
        watch_kernel().begin_again(self._memory)

    def remembered(self) -> dict[str, Array]:
        """Return the full state of the watch, for `resume`.

        Returns
        -------
        dict[str, ndarray]
            Copies, by name.
        """
        kept = {f"memory_{i}": one.copy() for i, one in enumerate(self._memory)}
        kept["asked"] = np.array([self.sample_time, self.pressure, *self._setting, *self._sizes])
        kept["start"] = np.array([self.start])
        kept["open"] = np.empty(0)
        if self._open is not None:
            alarm, changed, due = self._open
            told = alarm.time, self.balances.index(alarm.balance), alarm.since, *alarm.interval
            kept["open"] = np.array([*told, alarm.score, alarm.threshold, changed, due])
        return kept

    def resume(self, kept: Mapping[str, Array]) -> None:
        """Continue exactly from where another watch of the same settings stopped.

        Parameters
        ----------
        kept : Mapping[str, ndarray], each of its own shape
            Its state, from `remembered` [any unit].

        Raises
        ------
        HydrostateError
            If that watch had other settings.
        """
        own = self.remembered()
        alike = all(name in kept and (name == "open" or kept[name].shape == own[name].shape) for name in own)
        if not alike or not np.array_equal(kept["asked"], own["asked"]):
            said = "a watch can only continue one of the same rig, channels, rate, learning and false alarms"
            raise HydrostateError(f"{said}; to learn again, delete its state file")
        for i, one in enumerate(self._memory):
            one[:] = kept[f"memory_{i}"]
        self.start = float(kept["start"][0])
        if len(kept["open"]):
            time, which, since, first, last, score, limit, changed, due = kept["open"].tolist()
            alarm = Alarm(time, self.balances[int(which)], since, (first, last), score, limit)
            self._open = alarm, int(changed), int(due)

    @property
    def _taken(self) -> int:
        """Samples taken, including those of the current block."""
        intervals = int(self._clock[ALL]) * INTERVALS + int(self._partial[WHOLE])
        return intervals * self._sizes.samples + int(self._partial[SAMPLES])

    def _raise_alarm(self, which: int) -> Alarm:
        found, likely = change_time(self._recent_scores(which))
        duration = self.block * self.sample_time
        alarm = Alarm(
            self.time,
            self.balances[which],
            self.time - found * duration,
            (self.time - (likely[1] + BUILD_UP) * duration, self.time - (likely[0] - 1) * duration),
            float(self._score[which, SUM]),
            float(self._score[which, THRESHOLD]),
        )
        now = int(self._clock[ALL])
        self._open = alarm, now - found, now + round(AFTER / duration)
        watch_kernel().begin_again(self._memory)
        return alarm

    def _loss_events(self) -> list[Event]:
        """Return the alarm for slow growth of the loss, with the changes since the usual loss was learnt."""
        known, seen = self._known, int(self._known[SEEN])
        kept = np.arange(max(0, seen - KEPT_SPANS), seen) % KEPT_SPANS
        levels, ends = self._memory.levels[kept].T
        since, interval = growth_time(levels, self.start + ends * self.block * self.sample_time)
        alarm = Alarm(self.time, LOSS_BALANCE, since, interval, float(known[RISEN]), float(known[LIMIT]))
        lost = (float(known[SHARE]), float(known[LAST])) if self.pressure else None
        resisted = float(known[LAST_RESISTANCE] / known[RESISTANCE] - 1.0) if self.pressure else None
        learn_loss_again(known)
        return [alarm, Change(self.time, alarm, lost, resisted)]

    def _recent_scores(self, which: int) -> Array:
        """Return the last scores, newest first; those of blocks at rest are left out as zero."""
        clock = self._clock
        now, usable = int(clock[ALL]), min(int(clock[USABLE] - clock[LEARNT_FROM]), RECENT // 2)
        return np.nan_to_num(self._memory.scores[which, (now - 1 - np.arange(usable)) % RECENT])

    def _change_events(self) -> list[Event]:
        if self._open is None:
            return []
        (alarm, changed, now), self._open = self._open, None
        span = RECENT - 1 - (now - changed)
        gains = self._memory.gains
        before = gains[np.arange(changed - min(span, changed), changed) % RECENT].sum(axis=0)
        after = gains[np.arange(changed + 1, now) % RECENT].sum(axis=0)
        if not self.pressure or min(*before[[GAIN_WP, GAIN_VV]], *after[[GAIN_WP, GAIN_VV]]) <= 0.0:
            return [Change(self.time, alarm, None, None)]
        lost = float(before[GAIN_QP] / before[GAIN_WP]), float(after[GAIN_QP] / after[GAIN_WP])
        resisted = float(after[GAIN_PV] / after[GAIN_VV] / (before[GAIN_PV] / before[GAIN_VV]) - 1.0)
        over_pressure = after[GAIN_QP] / after[GAIN_PP] * before[GAIN_PP] / before[GAIN_WP]  # as under the earlier load
        if min(lost[1], over_pressure) - lost[0] > oil_allowance(lost[0]):  # so that the slow alarm does not repeat it
            learn_loss_again(self._known)
        return [Change(self.time, alarm, lost, resisted)]


def watch_record(
    record: Record, parameters: EhaParameters, *, false_alarms: float = 1.0, learning: float = LEARNING
) -> list[Event]:
    """Watch a log from its beginning to its end.

    Parameters
    ----------
    record : Record
        With motor speed, position or velocity, and differential pressure if there is one.
    false_alarms : float
        Rate of false alarms in a healthy log [1/h].
    learning : float
        Healthy running at its beginning [s].

    Raises
    ------
    HydrostateError
        If a channel is missing, or a rate or time is not usable.
    """
    samples, pressure = watched_samples({name: record[name] for name in record}, record.sample_time)
    options = {"false_alarms": false_alarms, "learning": learning, "start": record.start_time}
    return Watch(parameters, record.sample_time, pressure=pressure, **options).take(samples)
