"""`unseen_valve_note(fit)`, `open_wear_note(promise, most)`: notes on faults that a fit does not exclude."""

import math
from collections.abc import Collection, Mapping

import numpy as np

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypothesis_search.predicted_gains import PredictedGain
from estimation.log_checks.channel_names import PRESSURE, SPEED
from estimation.models.completed_flow import CRACKS
from estimation.models.flow import FLOW_FORM
from estimation.notes import RigCode
from plant.notes import Note

OPEN_DELIVERY = 0.1
"""Decrease of the logarithm of the pump's delivery that two deviations must allow before a worn pump is "not excluded"
[dimensionless]: the probability of a delivery below 90 % is then 2 % or more."""

LEAST_WORN = 0.03
"""Most likely decrease from which a worn pump is "not excluded" although two deviations exclude a sound one
[dimensionless]: slopes predict too little for a pump that is far from sound. In 88 sound training logs at one speed no
prediction was as large unless it was open already."""

LOSE_FLOW = frozenset(
    {
        "leakage_growth",
        "leakage_rise",
        "leakage_step",
        "leakage_turbulent",
        "makeup_blocked",
        "port_a_drains",
        "port_b_drains",
        "pump_compresses",
        "relief_low",
        "single_rod",
    }
)
"""Hypotheses with a loss or swept flow that is neither leakage of one coefficient nor a flow bias."""


def unseen_valve_note(fit: GreyBoxFit) -> tuple[Note, ...]:
    """Return a note if a log shows the effect of one make-up valve only.

    A valve that never opens does not change the likelihood. In sound actuators that are driven in both directions both
    valves have an effect.

    Parameters
    ----------
    fit : GreyBoxFit
        A fit of the flow form; one without cracking valves gives no note.

    Returns
    -------
    tuple of Note
        One at most.
    """
    unseen = [side for side, name in zip("AB", CRACKS, strict=True) if np.isinf(fit.std.get(name, 0.0))]
    return (unseen_note(unseen[0]),) if len(unseen) == 1 else ()


def unseen_note(side: str) -> Note:
    """Return the note on a make-up valve that a log does not show.

    Parameters
    ----------
    side : str
        Its chamber, or both if the log shows neither.
    """
    return RigCode.MAKEUP_UNSEEN.note(side=side)


def blocked_note(side: str) -> Note:
    """Return the note on a make-up valve that stays shut.

    Parameters
    ----------
    side : str
        Its chamber, or both if the log does not show which.
    """
    return RigCode.MAKEUP_BLOCKED.note(side=side)


def share_lost(
    log: GreyBoxLog, values: Mapping[str, float], displacement: float, strange: Collection[str] = ()
) -> float:
    """Return how far the logarithm of a pump's delivery may be below that of a sound pump, if no leakage is negative.

    The flow that a worn pump does not deliver is leakage and flow bias in a fit with a sound pump. Slopes do not know
    that both are positive.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as a flow form sees it.
    values : Mapping[str, float]
        Parameters of a fit with a sound pump [SI].
    displacement : float
        Displacement of that pump [m^3/rad].
    strange : collection of str
        Hypotheses that explain the log.

    Returns
    -------
    float
        Logarithm of the pumped flow over what remains of it, in the mean of the log [dimensionless]; infinite if all is
        lost, if the fit determines neither loss, or if flow is lost in another way.
    """
    if LOSE_FLOW & set(strange) or not {"flow_bias", "leakage_coefficient"} <= set(values):
        return math.inf
    pumped = displacement * float(np.nanmean(np.abs(log.drives[:, FLOW_FORM.drives.index(SPEED)])))
    pressure = float(np.nanmean(np.abs(log.measured[:, FLOW_FORM.outputs.index(PRESSURE)])))
    lost = values["flow_bias"] + values["leakage_coefficient"] * pressure
    return -math.log1p(-lost / pumped) if lost < pumped else math.inf


def open_wear_note(delivery: PredictedGain, most: float = math.inf) -> tuple[Note, ...]:
    """Return a note if a log cannot separate a worn pump from leakage or flow bias.

    Parameters
    ----------
    delivery : PredictedGain
        Predicted gain of another delivery beside all that is fitted.
    most : float
        How far the logarithm of the delivery may be below that of a sound pump, see `share_lost` [dimensionless].

    Returns
    -------
    tuple of Note
        One at most.
    """
    width = 2.0 * delivery.deviation
    less = width - delivery.size
    sound = delivery.size >= -max(width, LEAST_WORN)
    if sound and not min(less, most) > OPEN_DELIVERY:
        return ()
    if most < less:
        ends = {"likeliest": 100.0 * delivery.size, "most": 100.0 * most}
        return (RigCode.WEAR_NOT_EXCLUDED.note(percent=100.0 * most, half_width=100.0 * width, **ends),)
    return (RigCode.WEAR_NOT_EXCLUDED.note(percent=100.0 * less, half_width=100.0 * width),)
