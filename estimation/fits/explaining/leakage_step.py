"""Where leakage steps within a log, roughly: a start for the search that fits the step.

What the pump delivers and the piston does not sweep leaks, or goes into the oil as its pressure rises. A regression of
that loss on pressure, with one leakage before a time and another after, is solved for many times at once.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from estimation.fits.explaining.wide_log import usual_values
from estimation.fits.greybox.log import GreyBoxLog
from estimation.log_checks.channel_names import POSITION, SPEED
from estimation.models.wide_flow import WIDE_FLOW_FORM
from plant.arrays import Array

PIECES = 200
"""Pieces of the log in which flows and pressure are averaged [count]: a step is then known to half a percent of it."""

EDGE = 0.05
"""Share of the log before and after which no step is sought [fraction]."""

FIRST_WIDTH = 0.02
"""Length of the step with which a search begins [fraction of the log]: four pieces."""


class Step(NamedTuple):
    """A step of leakage.

    Parameters
    ----------
    first : Mapping[str, float]
        Leakage after it, and `leakage_before`, `step_at` and `step_width` of the wide form: first guesses [SI].
    share : float
        How much it explains of what one leakage leaves of the lost flow [fraction].
    """

    first: Mapping[str, float]
    share: float


NO_STEP = Step({}, 0.0)


def likeliest_step(log: GreyBoxLog) -> Step:
    """Return when leakage steps likeliest, and by how much.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.

    Returns
    -------
    Step
        `NO_STEP` where pressure is missing or still.
    """
    lost, along, others = _averaged(log)
    pieces = len(lost)
    splits = np.arange(round(EDGE * pieces), pieces - round(EDGE * pieces) + 1)
    if pieces < PIECES // 2:
        return NO_STEP
    columns = np.column_stack([along, others, lost])
    whole = columns.T @ columns
    early = np.cumsum(columns * along[:, None], axis=0)[splits - 1]  # products with pressure before a step
    late = whole[0] - early
    gram = np.zeros((len(splits), 4, 4))
    gram[:, 0, 0], gram[:, 1, 1] = early[:, 0], late[:, 0]
    gram[:, 0, 2:] = gram[:, 2:, 0] = early[:, 1:-1]
    gram[:, 1, 2:] = gram[:, 2:, 1] = late[:, 1:-1]
    gram[:, 2:, 2:] = whole[1:-1, 1:-1]
    right = np.column_stack([early[:, -1], late[:, -1], np.broadcast_to(whole[1:-1, -1], (len(splits), 2))])
    solved = np.einsum("sij,sj->si", np.linalg.pinv(gram, hermitian=True), right)
    explained = np.where(np.all(solved[:, :2] > 0.0, axis=1), np.einsum("si,si->s", right, solved), -np.inf)
    best = int(np.argmax(explained))
    if not np.isfinite(explained[best]):
        return NO_STEP
    before, after = map(float, solved[best, :2])
    first = {"leakage_coefficient": after, "leakage_before": before / after - 1.0}
    first |= {"step_at": float(splits[best]) / pieces, "step_width": FIRST_WIDTH}
    alike = float(whole[:-1, -1] @ np.linalg.pinv(whole[:-1, :-1], hermitian=True) @ whole[:-1, -1])
    left = float(whole[-1, -1])
    return Step(first, (float(explained[best]) - alike) / max(left - alike, float(np.finfo(float).tiny)))


def _averaged(log: GreyBoxLog) -> tuple[Array, Array, Array]:
    """Return the flow that is lost, the differential pressure, and what the loss goes with besides, piece by piece.

    That is the flow bias, with the speed's sign, and the rise of pressure; each of its own size.
    """
    named = {name: log.drives[:, at] for at, name in enumerate(WIDE_FLOW_FORM.drives)}
    rig = usual_values(log)
    speed, position, pressure = named[SPEED], named[POSITION], log.measured[:, 0]
    ends = np.unique(np.linspace(0, len(speed) - 1, PIECES + 1).astype(np.intp))
    count, time = np.diff(ends), log.sample_time * np.diff(ends)
    means = np.add.reduceat(np.stack([speed, pressure, np.sign(speed)])[:, : ends[-1]], ends[:-1], axis=1) / count
    swept = rig["piston_area"] * np.diff(position[ends]) / time
    lost = rig["pump_displacement"] * means[0] - swept
    rise = np.diff(pressure[ends]) / time
    there = np.isfinite(means[1]) & np.isfinite(rise)
    steepest = max(float(np.max(np.abs(rise[there]), initial=0.0)), 1.0)
    return lost[there], means[1, there], np.column_stack([means[2], rise / steepest])[there]
