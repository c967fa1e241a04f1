"""`CorrectedLogs(logged, rig).misread(plain, found)`: a wrong sign or unit without which a log would be the rig's.

Correlations of channels name such a slip in most logs (`estimation.log_checks.channel_physics`). A short log, or one
whose piston hardly moves, has too little of them. The flow form may even explain it, with oil a tenth as stiff and a
pump that loses more than it pumps. So where a fit ends there, slips are corrected in turn and the log is fitted again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import log as ln
from typing import NamedTuple

import numpy as np

from estimation.fits.flow.plain import FitStart, Logged, PlainFits, plain_fits
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.hypotheses import CHECKS_CRACK, MAKEUP_BENDS, OFFSET, PRESSURE_DRIFT
from estimation.fits.hypothesis_search.explain import WORTH, Explanation
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED, VELOCITY
from estimation.log_checks.channel_physics import LENGTHS, RPM, TURNS
from estimation.log_checks.flow_balance import MOST_LOST
from estimation.notes import ChannelCode
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note

FOREIGN, KIN = 7.0, 3.0
"""Times the rig file's bulk modulus, or its inverse, from which a slip is looked for, and up to which one that is set
right leaves oil like the rig's [dimensionless]; judged: air may leave a fifth of an oil's stiffness, while rpm read as
rad/s leaves a tenth."""

SURELY = 2.0
"""Deviations by which a fit that explains a log must be beyond what a rig's may be [dimensionless]."""

ASKED_SECONDS = 2.0
"""Time from when the pump turns on which slips are tried first [s]: it refutes most of them."""

TURNING = 0.1
"""Share of the highest speed from which the pump turns [fraction]: far above a resolver's noise at rest."""

ALIKE = 0.1
"""Share by which two fits' blocks may differ in number where their costs are compared [fraction]."""

FELT = 4.0
"""Variance of a pressure over that of its noise from which it changes [dimensionless]: twice the noise; judged. A dead
sensor shows its noise alone, and any slower pump explains that."""

UNLIKE_SLIPS = frozenset({OFFSET.name, PRESSURE_DRIFT.name, CHECKS_CRACK.name, MAKEUP_BENDS.name})
"""Hypotheses that no slip looks like: they add to a pressure, or concern valves, and change no scale and no sign."""

ROUNDING = 1e-9
"""Difference of logarithms that rounding may leave [dimensionless]."""

TURNED = "a wrong sign of {} (-UNIT)"
"""What is said of a channel that counts the other way."""

PRESSURES: Mapping[float, str] = {
    1e-2: "kPa read as bar",
    1e-1: "bar read as MPa",
    10.0: "MPa read as bar",
    100.0: "bar read as kPa",
    1e3: "kPa read as Pa",
    1e5: "bar read as Pa",
}
"""Slips of a pressure's unit, by what the values are to be multiplied with."""


class Slip(NamedTuple):
    """A mistake in how a channel was read.

    Parameters
    ----------
    channel : str
        Which.
    said : str
        What it looks like.
    factor : float
        What sets it right [dimensionless]; 0 where the channel is `other`.
    other : str
        Channel under whose heading it is; empty where it is under its own.
    """

    channel: str
    said: str
    factor: float
    other: str = ""


SLIPS: Sequence[Slip] = (
    Slip(SPEED, TURNED.format(SPEED), -1.0),
    *(Slip(SPEED, said, times) for times, said in TURNS.items()),
    Slip(SPEED, "krpm read as rad/s", 1e3 / RPM),
    Slip(PRESSURE, TURNED.format(PRESSURE), -1.0),
    *(Slip(PRESSURE, said, times) for times, said in PRESSURES.items()),
    Slip(POSITION, TURNED.format(POSITION), -1.0),
    Slip(POSITION, LENGTHS[1e3], 1e-3),
    Slip(POSITION, f"{VELOCITY} in the place of {POSITION}", 0.0, VELOCITY),
)
"""Mistakes that are tried."""


@dataclass(frozen=True, eq=False)
class CorrectedLogs:
    """A log with its channels corrected for one slip at a time, and fitted where that is asked for.

    Parameters
    ----------
    logged : Logged
        The log.
    rig : EhaParameters
        The actuator, as its file has it.
    """

    logged: Logged
    rig: EhaParameters

    def misread(self, plain: PlainFits, found: GreyBoxFit) -> Note | None:
        """Return the slips that make a log one of the rig's, where a fit says that it is none as it was read.

        Parameters
        ----------
        plain : PlainFits
            The log's fits by the plain form.
        found : GreyBoxFit
            The fit that is believed most.

        Returns
        -------
        Note or None
            None where the fit is one of the rig's kin, no slip makes it so, or pressure does not change.
        """
        if self.is_kin(plain, found) or not _pressed(self.logged):
            return None
        slips = [slip for slip, one in self._explained if _lost_to(found, one) < WORTH]
        return _told(slips) if slips else None

    def is_kin(self, plain: PlainFits, found: GreyBoxFit) -> bool:
        """Return whether a fit says that the log may be one of the rig's, as it was read.

        Parameters
        ----------
        plain : PlainFits
            The log's fits by the plain form.
        found : GreyBoxFit
            The fit.
        """
        return _kin(found, self.rig, FOREIGN, SURELY if plain.explains(found) else 0.0)

    def is_sound(self, plain: PlainFits, strange: Explanation) -> bool:
        """Return whether what is strange makes the log one of the rig's, and is nothing that a slip looks like.

        Parameters
        ----------
        plain : PlainFits
            The log's fits by the plain form.
        strange : Explanation
            What is strange about the log.
        """
        return UNLIKE_SLIPS.issuperset(strange.names) and self.is_kin(plain, strange.fit)

    @cached_property
    def _explained(self) -> Sequence[tuple[Slip, GreyBoxFit]]:
        """The slips without which the log is one of the rig's, each with its fit."""
        begun, rig = _beginning(self.logged), self.rig
        fits = [(slip, one) for slip in SLIPS if (one := _right_with(slip, begun, rig)) is not None]
        if begun is self.logged:
            return fits
        return [(slip, one) for slip, _ in fits if (one := _right_with(slip, self.logged, rig)) is not None]


def _told(slips: Sequence[Slip]) -> Note:
    channels = dict.fromkeys(slip.channel for slip in slips)
    said = " or ".join(slip.said for slip in slips)
    return ChannelCode.CHANNEL_MISREAD.note(channel=" or ".join(channels), slip=said)


def _lost_to(found: GreyBoxFit, other: GreyBoxFit) -> float:
    """Return by how much a fit is likelier than another; 0 where their blocks differ [log-likelihood]."""
    lost = 0.5 * found.seen * (other.chi_square[0] - found.chi_square[0])
    return lost if abs(other.seen - found.seen) < ALIKE * found.seen else 0.0


def _kin(fit: GreyBoxFit, rig: EhaParameters, times: float, surely: float) -> bool:
    """Return whether a fit's oil may be the rig's, and its pump loses no more than a leaky one does.

    A flow bias is a quarter of the rated flow at most. A leak that takes all of it before the piston slides is none of
    an actuator that moves.
    """
    slides = rig.friction_coulomb / rig.piston_area
    most = {"flow_bias": MOST_LOST * rig.rated_flow, "leakage_coefficient": rig.rated_flow / slides}
    if any(fit.values.get(name, 0.0) - surely * fit.std.get(name, 0.0) > largest for name, largest in most.items()):
        return False
    modulus = fit.values["bulk_modulus"]
    if modulus <= 0.0:
        return False
    std = min(fit.std["bulk_modulus"] / modulus, 1.0)  # of a logarithm that is not held, lest any oil be the rig's
    return abs(ln(modulus / rig.bulk_modulus)) - surely * std < ln(times)


def _pressed(logged: Logged) -> bool:
    return bool(np.nanvar(logged.record[PRESSURE]) > FELT * logged.variances[PRESSURE])


def _beginning(logged: Logged) -> Logged:
    """Return a log up to where its pump has turned for some time; all of it if that is no less."""
    record = logged.record
    speed = np.abs(record[SPEED])
    told = np.all([np.isfinite(record[name]) for name in (SPEED, POSITION, PRESSURE)], axis=0)
    turning = np.flatnonzero(told & (speed > TURNING * np.nanmax(speed)))
    if not len(turning):
        return logged
    samples = int(turning[0]) + round(ASKED_SECONDS / record.sample_time) + 1
    return logged if samples >= len(record) else replace(logged, record=record.slice(0, samples))


def _right_with(slip: Slip, logged: Logged, rig: EhaParameters) -> GreyBoxFit | None:
    """Return the fit of a log whose slip is set right, where it explains the log as one of the rig's."""
    set_right = _set_right(slip, logged)
    if set_right is None or not _slides_as_well(set_right.record, logged.record, rig):
        return None
    plain = plain_fits(set_right, FitStart(rig, rig.bulk_modulus))
    return plain.best if plain.explains(plain.best) and _kin(plain.best, rig, KIN, 0.0) else None


def _slides_as_well(right: Record, read: Record, rig: EhaParameters) -> bool:
    """Return whether a corrected pressure is no further from what the rig's friction takes than it was as read.

    Only this tells a unit from oil as many times as stiff: a flow balance holds pressure over stiffness. Conditions
    change friction less than any unit does.
    """

    def off(record: Record) -> float:
        turning = np.abs(record[SPEED]) > TURNING * np.nanmax(np.abs(record[SPEED]))
        pressure = np.nanmedian(np.abs(record[PRESSURE][turning]))
        return abs(ln(pressure * rig.piston_area / rig.friction_coulomb)) if pressure > 0.0 else np.inf

    return off(right) <= off(read) + ROUNDING


def _set_right(slip: Slip, logged: Logged) -> Logged | None:
    record, variances = logged.record, logged.variances
    if slip.other:
        if slip.other not in record:
            return None
        changed, noise = record[slip.other], variances.get(slip.other, np.nan)
    else:
        changed, noise = slip.factor * record[slip.channel], slip.factor**2 * variances[slip.channel]
    if not np.isfinite(noise):
        return None
    return Logged(record.replace(**{slip.channel: changed}), {**variances, slip.channel: noise}, logged.uncertainties)
