"""`PressureMean`: a pressure of which each value is the mean of several rows, as a fit compares it with its model.

The rows of a mean all get its value. A fit compares means over blocks of as many rows, so that the model is averaged
exactly as the pressure was, whatever its valves do in between.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from plant.log.record import Record


class PressureMean(NamedTuple):
    """Where a mean over rows is written.

    Parameters
    ----------
    rows : int
        Rows of a mean; 1 if none was taken [count].
    after : int
        Rows from the first one of a mean to that in which it is written [count].
    first : int
        Rows before the first mean that counts [count]; those before the first block of a fast log, see `averaged_log`.
    """

    rows: int = 1
    after: int = 0
    first: int = 0

    @property
    def late_rows(self) -> float:
        """Rows by which a mean is written after the middle of its rows [count]."""
        return self.after - 0.5 * (self.rows - 1)

    def begun(self, record: Record) -> Record:
        """Return a log that begins so many rows before its first whole mean.

        Parameters
        ----------
        record : Record
            A log that has one mean in so many rows, the first one in row ``rows - 1``.
        """
        return record if self.rows == 1 else record.slice((self.rows - 1 - self.after - self.first) % self.rows)

    def spread(self, log: GreyBoxLog) -> GreyBoxLog:
        """Return a log whose means stand in all of their rows, and are compared with those of the model.

        Parameters
        ----------
        log : GreyBoxLog
            The log, see `begun`.
        """
        if self.rows == 1:
            return log
        count = (len(log.measured) - self.first) // self.rows
        written = log.measured[self.first + self.after :: self.rows][:count]
        measured = np.full_like(log.measured, np.nan)
        measured[self.first :][: len(written) * self.rows] = np.repeat(written, self.rows, axis=0)
        noise = tuple(replace(one, variance=self.rows * one.variance) for one in log.noise)
        return replace(log, measured=measured, noise=noise, mean_rows=self.rows)

    def block_of(self, log: GreyBoxLog, block: int) -> int:
        """Return over how many samples a log is averaged: a fast one over its means, and no other.

        Parameters
        ----------
        log : GreyBoxLog
            The log, its means in all of their rows.
        block : int
            The same for a log whose pressure is not a mean [count].
        """
        return block if log.mean_rows == 1 else self.rows if self.first else 1

    def judged(self, log: GreyBoxLog) -> GreyBoxLog:
        """Return a log whose residuals are averaged over whole means, and over no shorter time than before.

        Parameters
        ----------
        log : GreyBoxLog
            The log, its means in all of their rows.
        """
        if log.mean_rows == 1:
            return log
        span = self.rows * log.sample_time
        return replace(log, block=max(1, round(log.block / span)) * span)


NO_MEAN = PressureMean()
"""Each value is that of its own row."""
