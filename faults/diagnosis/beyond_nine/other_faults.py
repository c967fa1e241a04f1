"""Faults outside the nine conditions, without pressure: whether one explains the log better than any of the nine.

With pressure, the flow balance tests for a worn pump, for make-up valves that stick or leak and for a relief valve with
a low setting. Without pressure, a circuit with each of these faults is compared with a sound one over the regions of
all nine conditions (`class_regions`): the difference of their scores is the logarithm of a Bayes factor. What no rig
file states of a sound circuit (its case drain, its make-up valves) may explain more than a fault does, so the best of
several sound circuits is used.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from faults.conditions import CONDITIONS
from faults.diagnosis.beyond_nine.faulty_circuits import (
    EARLY,
    HOPELESS,
    STUCK,
    WORN,
    Fault,
    delivery_note,
    fits_with_faults,
)
from faults.diagnosis.beyond_nine.left_open import (
    DELIVERIES,
    LEAST_REPORTED,
    STUCK_VALVE_PRIOR,
    OpenFault,
    fault_probabilities,
    hidden_relief_log_prior,
    not_excluded_notes,
    odds_of_wear,
)
from faults.diagnosis.beyond_nine.sound_circuit import Trial, largest_pressure, log_likelihood, sound_circuit
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import nominal_runs
from faults.diagnosis.circuits.class_regions import ClassFits, fit_classes, is_stuck
from faults.diagnosis.circuits.pressure_scale import SCALE_INFORMATION, scale_between
from plant.arrays import Array
from plant.notes import Note

GAIN = 4.0
"""Log-likelihood over all regions that a fault must gain to be believed, in `LASTING` blocks that count as one
[dimensionless]: a Bayes factor of 55. With the prior of such a fault, its probability is then one half."""

NOT_EXCLUDED = -3.0
"""The same, from which a fault is not excluded [dimensionless]: a Bayes factor of a twentieth."""

UNSEEN_STUCK_ODDS = math.log(STUCK_VALVE_PRIOR / (1.0 - STUCK_VALVE_PRIOR))
"""Prior log-odds of a stuck valve if the log does not show it [dimensionless]: as with pressure."""

SOUND = "a sound circuit"
"""Name of a circuit that differs from the rig file's in what no rig file states."""

BELIEVED_ODDS = 10.0
"""How many times likelier than a sound pump a well worn one must be to be believed [dimensionless]: evidence is called
strong above that (Jeffreys, Theory of Probability, 1961, appendix B). In 16 sound training logs under major leakage and
friction none exceeds 1.4."""

SETTING_SPREAD = 0.1
"""Deviation of the logarithm of a relief valve's setting, judged [dimensionless]: one sound about the rig file's, and
one set low about the nearest of `SETTINGS`."""


class OutsideFaults(NamedTuple):
    """Findings on faults outside the nine conditions.

    Parameters
    ----------
    against : tuple of Note
        The fault that a log shows, a reason against all nine.
    open : tuple of Note
        The faults that the log leaves open.
    worn_scores : ndarray, shape (1 + pumps, 9), optional
        How well each condition fits the log with a sound pump, then with each of `DELIVERIES`: log-likelihoods
        [dimensionless]; None if a worn pump is excluded.
    faulty : float
        Probability that one of the open faults is present [probability].
    """

    against: tuple[Note, ...] = ()
    open: tuple[Note, ...] = ()
    worn_scores: Array | None = None
    faulty: float = 0.0


@dataclass(frozen=True, eq=False)
class _FaultyCircuits:
    """Circuits with faults beside the best sound one: what each gains over it in explaining a log."""

    blocks: Blocks
    faulty: tuple[tuple[Fault, Trial], ...]
    sound: Trial

    def gain(self, fault: Fault, tried: Trial) -> float:
        """Return the log-likelihood that a fault gains, with the prior of its size [dimensionless]."""
        gain = log_likelihood(self.blocks, tried) - log_likelihood(self.blocks, self.sound)
        return gain + fault.log_prior + _scale_gain(self.blocks, tried, self.sound)

    @property
    def leading(self) -> tuple[Fault, Trial]:
        """The fault that gains most, and its circuit."""
        return max(self.faulty, key=lambda one: self.gain(*one) - one[0].extra_gain)

    @property
    def delivery_scores(self) -> list[float]:
        """How well pumps with each of `DELIVERIES` explain the log [dimensionless]."""
        return [log_likelihood(self.blocks, tried) for fault, tried in self.faulty if fault.name == WORN]

    @property
    def wear_log_odds(self) -> float:
        """Log-odds of a well worn pump against a sound one."""
        return odds_of_wear(self.delivery_scores, log_likelihood(self.blocks, self.sound))

    @property
    def shown_fault(self) -> Note | None:
        """The fault that is likelier than a sound actuator."""
        fault, tried = self.leading
        if self.gain(fault, tried) - fault.extra_gain > GAIN:
            return fault.note
        worn = self.wear_log_odds > math.log(BELIEVED_ODDS)
        return delivery_note(DELIVERIES[int(np.argmax(self.delivery_scores))]) if worn else None


def faults_outside(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> OutsideFaults:
    """Return the fault outside the nine conditions that a log without pressure shows, and those that it leaves open.

    Parameters
    ----------
    blocks : Blocks
        The log in blocks, without pressure.

    Returns
    -------
    OutsideFaults
        Empty with pressure, and if the piston sticks.
    """
    if blocks.pressure is not None or is_stuck(blocks, actuator):
        return OutsideFaults()
    runs = nominal_runs(blocks, actuator)
    sound = sound_circuit(blocks, fits, actuator, runs)
    beside = _FaultyCircuits(blocks, tuple(fits_with_faults(blocks, sound, runs)), sound)
    beside = _with_sound_searched_again(beside, runs)
    shown = beside.shown_fault
    return OutsideFaults((shown,)) if shown is not None else _faults_left_open(beside)


def circuits_with_faults(
    blocks: Blocks, fits: ClassFits, actuator: Actuator, gained: float
) -> Iterator[tuple[float, ClassFits]]:
    """Yield circuits with each of the tested faults, fitted to a log without pressure.

    Parameters
    ----------
    blocks : Blocks
        The log in blocks, without pressure.
    fits : ClassFits
        The circuits without a fault that were fitted to it.
    gained : float
        Log-likelihood that one must gain on these to be of use [dimensionless]: a search that will end `HOPELESS` below
        that ends early.

    Yields
    ------
    tuple of float and ClassFits
        Prior log-odds of the fault against a sound actuator [dimensionless], and the circuits with it.
    """
    runs = nominal_runs(blocks, actuator)
    for fault, tried in fits_with_faults(blocks, sound_circuit(blocks, fits, actuator, runs), runs, HOPELESS - gained):
        yield fault.log_prior - GAIN, tried.fits


class OtherCircuits(NamedTuple):
    """Circuits other than the rig file's, with a fault or without, and how well they explain a log.

    Parameters
    ----------
    gains : Mapping[str, float]
        By name of the fault: log-likelihood of the best circuit with it over that of the best sound one, with the prior
        of its size; as `SOUND`, of the best sound one over the rig file's [dimensionless].
    sound : Trial
        The best sound one.
    """

    gains: Mapping[str, float]
    sound: Trial

    @property
    def condition(self) -> str | None:
        """The only condition that the best sound one does not exclude; None if there are more."""
        left = np.flatnonzero(self.sound.fits.scores > self.sound.score + NOT_EXCLUDED)
        return list(CONDITIONS)[int(left[0])] if len(left) == 1 else None


def other_circuits(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> OtherCircuits:
    """Return how well circuits other than the rig file's explain a log, with or without pressure.

    Parameters
    ----------
    blocks : Blocks
        The log in blocks.
    fits : ClassFits
        The circuits without a fault that were fitted to it.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    OtherCircuits
        Those with each of the tested faults, and sound ones that differ in what no rig file states.
    """
    runs = nominal_runs(blocks, actuator)
    sound = sound_circuit(blocks, fits, actuator, runs)
    gains = {SOUND: sound.score - float(np.max(fits.scores))}
    for fault, tried in fits_with_faults(blocks, sound, runs):
        gain = tried.score - sound.score + fault.log_prior
        gains[fault.name] = max(gain, gains.get(fault.name, gain))
    return OtherCircuits(gains, sound)


def _with_sound_searched_again(beside: _FaultyCircuits, runs: Array) -> _FaultyCircuits:
    """Return the circuits with the sound one searched again from each faulty one that is likelier, and once anew.

    A search may end short of the best, and a fault that is likelier only for that reason is not taken.
    """
    asked, actuator = list[Fault](), beside.sound.actuator
    while beside.shown_fault is not None and (leading := beside.leading)[0] not in asked:
        starts = (leading[1].fits.best.coordinates, *(() if asked else (None,)))
        again = [Trial(actuator, fit_classes(beside.blocks, actuator, runs=runs, start=start)) for start in starts]
        likeliest = max([beside.sound, *again], key=lambda one: log_likelihood(beside.blocks, one))
        beside = replace(beside, sound=likeliest)
        asked.append(leading[0])
    return beside


def _faults_left_open(beside: _FaultyCircuits) -> OutsideFaults:
    """Return the faults that a log does not exclude, though it shows none."""
    sound, gains, likeliest = beside.sound, dict[str, float](), dict[str, Array]()
    for fault, tried in beside.faulty:
        gain = beside.gain(fault, tried)
        if gain >= gains.get(fault.name, gain):
            gains[fault.name], likeliest[fault.name] = gain, tried.fits.scores
    odds = _log_odds(gains, beside.wear_log_odds)
    best, pressure = sound.fits.scores, largest_pressure(beside.blocks, sound.fits.best, sound.actuator)
    hidden = hidden_relief_log_prior(pressure, sound.actuator.circuit.relief_pressure) - GAIN
    likeliest[EARLY] = likeliest[EARLY] if odds.get(EARLY, -math.inf) > hidden else best  # if hidden, no score changes
    odds[EARLY] = float(np.logaddexp(odds.get(EARLY, -math.inf), hidden))
    chances = fault_probabilities(odds)
    # if the pressure came near the rig file's setting, few settings remain above it, and a report would say little
    told = {name: chance for name, chance in chances.items() if name != EARLY or chance > LEAST_REPORTED}
    above = {EARLY: f"{EARLY}, above {1e-5 * pressure:.2g} bar"} if likeliest[EARLY] is best else {}
    open_ = [OpenFault(above.get(name, name), chance, likeliest.get(name, best)) for name, chance in told.items()]
    worn = [tried.fits.scores for fault, tried in beside.faulty if fault.name == WORN]
    scores = np.array([best, *worn]) if WORN in odds else None
    return OutsideFaults((), not_excluded_notes(open_, best), scores, sum(chances.values()))


def _log_odds(gains: Mapping[str, float], wear: float) -> dict[str, float]:
    """Return the log-odds of each fault that a log does not exclude, by what it gains; ``wear`` are those of wear."""
    odds = {name: gain - GAIN for name, gain in gains.items() if gain > NOT_EXCLUDED}
    if WORN in odds:
        odds[WORN] = wear
    if STUCK in odds:  # a valve that never had to open fits like a sound one, so it keeps at least its prior odds
        odds[STUCK] = max(odds[STUCK], min(gains[STUCK], 0.0) + UNSEEN_STUCK_ODDS)
    return odds


def _scale_gain(blocks: Blocks, tried: Trial, sound: Trial) -> float:
    """Return what a low relief valve gains by the scale of pressures, of which no score knows [dimensionless].

    Nothing where the sound circuit's valve stays shut: one that opens tells the scale.
    """
    setting = sound.actuator.circuit.relief_pressure
    if not tried.actuator.circuit.relief_pressure < setting:
        return 0.0
    opens = largest_pressure(blocks, sound.fits.best.as_run, sound.actuator) >= setting
    return _scale_log_likelihood(tried) - _scale_log_likelihood(sound) if opens else 0.0


def _scale_log_likelihood(tried: Trial) -> float:
    """Return the log-likelihood of a circuit's scale of pressures in the condition that holds it [dimensionless]."""
    centre = tried.actuator.conditions[int(np.argmax(tried.fits.scores))]
    scale = scale_between(tried.fits.best.as_run.coordinates, centre)
    return -0.5 * scale**2 / (1.0 / SCALE_INFORMATION + SETTING_SPREAD**2)
