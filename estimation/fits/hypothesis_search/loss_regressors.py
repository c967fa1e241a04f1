"""Regressors of a varying loss: position, shaft angle, speed, pressure, or direction.

A scored bore leaks where the piston passes the score, and a worn tooth once a turn. A pump that fills badly loses flow
above some speed, a lip that lifts leaks above some pressure, and a leaking relief valve leaks in one direction. See
decision 288.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypothesis_search.fault_guesses import leakage_guess
from plant.arrays import Array
from plant.eha.model import EhaParameters

BORE, TOOTH, FILLING, LIFTING, ONE_WAY, WEAR = "bore", "tooth", "filling", "lifting", "one_way", "wear"
"""What a loss depends on: position, the shaft's angle, speed above a limit, pressure above a limit, the sign of
pressure, speed."""

AVERAGING_TIME = 1e-2
"""Time over which pressure is averaged to find its sign [s]; judged: it reverses about as fast."""

NARROWEST = 2e-4
"""Least width of a score [m], or of a tooth's engagement over a tenth of it [rad]; judged."""

LEAST_POWER, MOST_POWER = 0.7, 3.0
"""Exponents with which a loss may grow above its limit [dimensionless]: a flow that the pump cannot take in grows
linearly, the flow through a lip that pressure opens grows with the cube of its gap."""

WIDEST_TOOTH = 1.0
"""Largest width of a tooth's engagement [rad]: a wider one is not that of a single tooth."""


@dataclass(frozen=True)
class LossRegressor:
    """A signal with which a loss varies.

    Parameters
    ----------
    kind : str
        `BORE`, `TOOTH`, `FILLING`, `LIFTING`, `ONE_WAY` or `WEAR`.
    at : float
        Where it is largest [m, rad], the limit above which it grows [rad/s, Pa], or the sign of its pressure.
    width : float
        Its width [m, rad], or the exponent of its growth above the limit [dimensionless]; 1 if it has neither.
    """

    kind: str
    at: float
    width: float = 1.0

    @property
    def free(self) -> tuple[str, ...]:
        """Fields that are fitted."""
        return () if self.kind in (ONE_WAY, WEAR) else ("at", "width")


class LossSignals(NamedTuple):
    """The measured signals from which loss regressors are computed.

    Parameters
    ----------
    speed, angle, position, pressure : ndarray, shape (n,)
        Motor speed and angle [rad/s, rad], piston position [m], differential pressure [Pa].
    steady : ndarray, shape (n,)
        The pressure averaged over `AVERAGING_TIME` [Pa]: at rest, half of its noise would count as one direction.
    leakage, displacement : float
        Values of the rig [m^3/(s Pa), m^3/rad].
    """

    speed: Array
    angle: Array
    position: Array
    pressure: Array
    steady: Array
    leakage: float
    displacement: float

    def of(self, course: LossRegressor) -> Array:
        """Return one unit of a loss: a healthy leakage at its maximum, or all flow above a speed limit.

        Parameters
        ----------
        course : LossRegressor
            What it depends on [SI].

        Returns
        -------
        ndarray, shape (n,)
            Flow from chamber 1 to chamber 2 [m^3/s].
        """
        along = self.leakage * self.pressure
        match course.kind:
            case "bore":
                return along * np.exp(-0.5 * ((self.position - course.at) / course.width) ** 2)
            case "tooth":
                return along * np.exp((np.cos(self.angle - course.at) - 1.0) / course.width**2)
            case "filling":
                return self.displacement * np.sign(self.speed) * _power_of_excess(self.speed, course)
            case "wear":
                return self.displacement * self.speed
            case "lifting":
                return self.leakage * np.sign(self.pressure) * _power_of_excess(self.pressure, course)
            case _:
                return self.leakage * np.where(self.steady * course.at > 0.0, self.steady, 0.0)

    def regressors_tried(self) -> list[LossRegressor]:
        """Return the regressors that are tried on a log.

        Returns
        -------
        list of LossRegressor
            A score only if the piston moves by several of its least widths.
        """
        low, high = float(np.min(self.position)), float(np.max(self.position))
        fastest = float(np.max(np.abs(self.speed)))
        highest = float(np.quantile(np.abs(self.pressure), 0.99))
        span = high - low
        places = np.linspace(low, high, 13).tolist() if span > 10.0 * NARROWEST else []
        return [
            *(LossRegressor(BORE, at, max(share * span, NARROWEST)) for at in places for share in (0.04, 0.1, 0.25)),
            *(LossRegressor(TOOTH, float(at), width) for at in np.arange(12) * np.pi / 6.0 for width in (0.25, 0.7)),
            *(LossRegressor(FILLING, share * fastest) for share in (0.2, 0.35, 0.5, 0.65, 0.8) if fastest > 0.0),
            *(LossRegressor(LIFTING, share * highest) for share in (0.3, 0.5, 0.65, 0.8, 0.9) if highest > 0.0),
            *(LossRegressor(ONE_WAY, side) for side in (-1.0, 1.0)),
            LossRegressor(WEAR, 0.0),
        ]

    def field_steps(self, course: LossRegressor) -> dict[str, float]:
        """Return the finite-difference steps of a regressor's fitted fields.

        Parameters
        ----------
        course : LossRegressor
            What a loss depends on [SI].

        Returns
        -------
        dict
            By fitted field, in its unit.
        """
        along = {BORE: 0.05 * course.width, TOOTH: 0.05, FILLING: 0.01 * course.at, LIFTING: 0.01 * course.at}
        return {name: along[course.kind] if name == "at" else 0.05 * course.width for name in course.free}


def _power_of_excess(what: Array, course: LossRegressor) -> Array:
    """Return a power of a signal's excess over a limit, in the signal's unit; the excess itself for a power of 1."""
    return course.at * np.maximum(np.abs(what) / course.at - 1.0, 0.0) ** course.width


def loss_signals(log: GreyBoxLog, parameters: EhaParameters) -> LossSignals:
    """Return the signals from which loss regressors are computed.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it.

    Returns
    -------
    LossSignals
        Pressure is interpolated over gaps, and zero if it is missing throughout.
    """
    speed, position, pressure = log.drives[:, 0], log.drives[:, 1], log.measured[:, 0]
    rows, seen = np.arange(len(pressure)), np.isfinite(pressure)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * log.sample_time * (speed[1:] + speed[:-1]))])
    pressure = np.interp(rows, rows[seen], pressure[seen]) if np.any(seen) else np.zeros(len(rows))
    half = round(0.5 * AVERAGING_TIME / log.sample_time)
    window = np.full(2 * half + 1, 1.0 / (2 * half + 1))
    return LossSignals(
        speed,
        angle,
        position,
        pressure,
        np.convolve(np.pad(pressure, half, mode="edge"), window, "valid"),
        leakage_guess(parameters),
        parameters.pump_displacement,
    )


def shifted_regressor(course: LossRegressor, step: Mapping[str, float], share: float) -> LossRegressor:
    """Return a regressor shifted by a share of a step.

    Parameters
    ----------
    course : LossRegressor
        What a loss depends on [SI].
    step : Mapping[str, float]
        The step, by field [SI].
    share : float
        Of that step [fraction].

    Returns
    -------
    LossRegressor
        Widths change by at most a factor of two, and stay within their bounds.

    Examples
    --------
    >>> shifted_regressor(LossRegressor(BORE, 0.01, 0.004), {"at": 0.002, "width": 0.1}, 0.5)
    LossRegressor(kind='bore', at=0.011, width=0.008)
    """
    changed = {name: getattr(course, name) + share * by for name, by in step.items()}
    if course.kind in (FILLING, LIFTING):
        changed["at"] = max(changed.get("at", course.at), 0.5 * course.at)
    if "width" in changed:
        powers = LEAST_POWER, MOST_POWER
        ends = {BORE: (NARROWEST, np.inf), TOOTH: (10.0 * NARROWEST, WIDEST_TOOTH), FILLING: powers, LIFTING: powers}
        least, most = ends[course.kind]
        width = min(max(changed["width"], 0.5 * course.width, least), 2.0 * course.width, most)
        changed["width"] = float(width)
    return replace(course, **changed)
