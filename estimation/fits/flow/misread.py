"""`misread(logged, plain, found)`: a wrong sign or unit without which a log would be one of the rig's.

Correlations of channels name such a slip in most logs (`estimation.log_checks.channel_physics`). A short log, or one
whose piston hardly moves, has too little of them. The flow form may even explain it, with oil a tenth as stiff and a
pump that loses more than it pumps. So where a fit ends there, slips are corrected in turn and the log is fitted again.
"""

from collections.abc import Mapping, Sequence
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
from plant.notes import Note

FOREIGN, KIN = 7.0, 3.0
"""Times the rig file's bulk modulus, or its inverse, from which a slip is looked for, and up to which one that is set
right leaves oil like the rig's [dimensionless]; judged: air may leave a fifth of an oil's stiffness, while rpm read as
rad/s leaves a tenth."""

SURELY = 2.0
"""Deviations by which a fit that explains a log must be beyond what a rig's may be [dimensionless]."""

ASKED_SECONDS = 2.0
"""Length of a log's beginning on which slips are tried first [s]: it refutes most of them."""

ALIKE = 0.1
"""Share by which two fits' blocks may differ in number where their costs are compared [fraction]."""

UNLIKE_SLIPS = frozenset({OFFSET.name, PRESSURE_DRIFT.name, CHECKS_CRACK.name, MAKEUP_BENDS.name})
"""Hypotheses that no slip looks like: they add to a pressure, or concern valves, and change no scale and no sign."""

TURNED = "its sign turned (-UNIT)"
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
    Slip(SPEED, TURNED, -1.0),
    *(Slip(SPEED, said, times) for times, said in TURNS.items()),
    Slip(SPEED, "krpm read as rad/s", 1e3 / RPM),
    Slip(PRESSURE, TURNED, -1.0),
    *(Slip(PRESSURE, said, times) for times, said in PRESSURES.items()),
    Slip(POSITION, TURNED, -1.0),
    Slip(POSITION, LENGTHS[1e3], 1e-3),
    Slip(POSITION, f"{VELOCITY} in its place", 0.0, VELOCITY),
)
"""Mistakes that are tried."""


def misread(logged: Logged, plain: PlainFits, found: GreyBoxFit, rig: EhaParameters) -> Note | None:
    """Return the slips that make a log one of the rig, where a fit says that it is none as it was read.

    Parameters
    ----------
    logged : Logged
        The log.
    plain : PlainFits
        Its fits by the plain form.
    found : GreyBoxFit
        The fit that is believed most.
    rig : EhaParameters
        The actuator, as its file has it.

    Returns
    -------
    Note or None
        None where the fit is one of the rig's kin, or no slip makes it so.
    """
    if is_kin(plain, found, rig):
        return None
    begun = _beginning(logged)
    fits = [(slip, one) for slip in SLIPS if (one := _right_with(slip, begun, rig)) is not None]
    if begun is not logged:
        fits = [(slip, one) for slip, _ in fits if (one := _right_with(slip, logged, rig)) is not None]
    fits = [(slip, one) for slip, one in fits if _lost_to(found, one) < WORTH]
    return _told([slip for slip, _ in fits]) if fits else None


def is_kin(plain: PlainFits, found: GreyBoxFit, rig: EhaParameters) -> bool:
    """Return whether a fit says that a log may be one of the rig's, as it was read.

    Parameters
    ----------
    plain : PlainFits
        The log's fits by the plain form.
    found : GreyBoxFit
        The fit.
    rig : EhaParameters
        The actuator, as its file has it.
    """
    return _kin(found, rig, FOREIGN, SURELY if plain.explains(found) else 0.0)


def no_slip(plain: PlainFits, strange: Explanation, rig: EhaParameters) -> bool:
    """Return whether what is strange about a log is none that a wrong sign or unit looks like, and makes it the rig's.

    Parameters
    ----------
    plain : PlainFits
        The log's fits by the plain form.
    strange : Explanation
        What is strange about the log.
    rig : EhaParameters
        The actuator, as its file has it.
    """
    return UNLIKE_SLIPS.issuperset(strange.names) and is_kin(plain, strange.fit, rig)


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
    std = (
        min(fit.std["bulk_modulus"] / modulus, 1.0) if modulus > 0.0 else 0.0
    )  # a logarithm that is not held may be any
    return modulus > 0.0 and abs(ln(modulus / rig.bulk_modulus)) - surely * std < ln(times)


def _beginning(logged: Logged) -> Logged:
    samples = round(ASKED_SECONDS / logged.record.sample_time) + 1
    if samples >= len(logged.record):
        return logged
    return Logged(logged.record.slice(0, samples), logged.variances)


def _right_with(slip: Slip, logged: Logged, rig: EhaParameters) -> GreyBoxFit | None:
    """Return the fit of a log whose slip is set right, where it explains the log as one of the rig's."""
    set_right = _set_right(slip, logged)
    if set_right is None:
        return None
    plain = plain_fits(set_right, FitStart(rig, rig.bulk_modulus))
    return plain.best if plain.explains(plain.best) and _kin(plain.best, rig, KIN, 0.0) else None


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
