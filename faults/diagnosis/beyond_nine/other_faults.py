"""Faults outside the nine conditions, without pressure: does one explain the log better than any of the nine.

Where pressure is logged, the balance of flows looks for a worn pump, for make-up valves that stick or leak and for a
relief valve that is set low. Without pressure, a circuit with each of these faults is compared with a sound one over
the regions of all nine conditions (`class_regions`): the difference of their scores is the logarithm of a Bayes factor.
What no rig file knows of a sound circuit (its case drain, its make-up valves) may explain more than a fault does, so
the best of several sound circuits is taken.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from faults.conditions import CONDITIONS
from faults.diagnosis.beyond_nine.left_open import (
    DELIVERIES,
    UNSEEN,
    WORTH_SAYING,
    OpenFault,
    not_excluded,
    odds_of_hidden_relief,
    odds_of_wear,
    probabilities_of,
)
from faults.diagnosis.beyond_nine.sound_circuit import Tried, sound_circuit
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES, parameter_rows, predicted
from faults.diagnosis.circuits.class_fit import LASTING, PointFit, misfit, nominal_runs
from faults.diagnosis.circuits.class_regions import ClassFits, fit_classes, is_stuck
from faults.notes import AgainstCode
from plant.arrays import Array
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.one_sided import one_sided
from plant.notes import Note

GAIN = 4.0
"""Log-likelihood over all regions that a fault must gain to be believed, in `LASTING` blocks that count as one
[dimensionless]: a Bayes factor of 55. It is as likely as not then, which is what is presumed of such a fault."""

NOT_EXCLUDED = -3.0
"""The same, from which a fault is not excluded [dimensionless]: a Bayes factor of a twentieth."""

HOPELESS = 20.0
"""Log-likelihood below the sound circuit at which a rough search leaves a fault [dimensionless]: a thorough one gained
up to 26 on it, but few. A search that would not come to it in the steps that are left ends there too."""

WORN = "a worn pump"
"""What that fault is called."""

EARLY = "a relief valve that opens early"
"""What that one is called."""

STUCK = "a make-up valve that is stuck shut"
"""What that one is called. One that never has to open leaves no trace, whatever it is."""

LEFT_UNSEEN = math.log(UNSEEN / (1.0 - UNSEEN))
"""Log-likelihood of one before a log is seen, where the log does not tell it [dimensionless]: as with pressure."""

SOUND = "a sound circuit"
"""What one is called that differs from the rig file's in what no rig file knows."""

LIKELIER = 10.0
"""How many times likelier than a sound pump a well worn one must be to be believed [dimensionless]: evidence is called
strong from there on (Jeffreys, Theory of Probability, 1961, appendix B). Of 16 sound training logs under major leakage
and friction none comes to more than 1.4."""

SHUT = (0.9, 0.97, 0.99, 1.0)
"""Shares of a make-up valve that are stuck shut [dimensionless]: one that lets a little oil through passes for friction
beside one that lets none through. A search finds no more than its neighbours."""

SEATS = (0.4, 1.0)
"""Leakage past the seat of a make-up valve, over all the leakage of an actuator with major leakage [dimensionless]."""

SETTINGS = (0.75, 0.9)
"""Settings of a relief valve, over the largest pressure that the sound circuit comes to in the log [dimensionless]."""

SO_SET = math.log(math.log(SETTINGS[1] / SETTINGS[0]) / math.log(10.0))
"""Log-likelihood that a low relief valve is set so, before a log is seen [dimensionless]: it may be set to a tenth of
what it should be, below which no piston slides, and each of `SETTINGS` stands for those about it."""


class Outside(NamedTuple):
    """Findings on faults outside the nine conditions.

    Parameters
    ----------
    against : tuple of Note
        The fault that a log shows, which speaks against all nine.
    open : tuple of Note
        The faults that it does not tell.
    worn : ndarray, shape (1 + pumps, 9), optional
        How well each condition holds it with a sound pump, then with one that delivers each of `DELIVERIES`:
        log-likelihoods [dimensionless]; None where a worn pump is excluded.
    faulty : float
        Probability that one of the faults that the log does not tell is there [probability].
    """

    against: tuple[Note, ...] = ()
    open: tuple[Note, ...] = ()
    worn: Array | None = None
    faulty: float = 0.0


@dataclass(frozen=True)
class _Fault:
    """A fault: what is said where it is there, what it is called where it is not excluded, and a circuit with it.

    The search for one that moves the log into another condition begins in that, any other at the sound circuit.
    What is presumed is the log-likelihood of its size before a log is seen [dimensionless].
    """

    note: Note
    name: str
    circuit: CircuitParameters
    elsewhere: bool = False
    presumed: float = 0.0


def faults_outside(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> Outside:
    """Return the fault outside the nine conditions that a log without pressure shows, and those that it does not tell.

    Parameters
    ----------
    blocks : Blocks
        The log in blocks, without pressure.
    fits : ClassFits
        The circuits fitted to it.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    Outside
        What is said of them; nothing with pressure, and where the piston sticks.
    """
    if blocks.pressure is not None or is_stuck(blocks, actuator):
        return Outside()
    runs = nominal_runs(blocks, actuator)
    sound = sound_circuit(blocks, fits, actuator, runs)
    gains, likeliest, worn = dict[str, float](), dict[str, Array](), list[Tried]()
    found: tuple[float, _Fault, Tried] | None = None
    for fault, tried in _with_each(blocks, sound, runs):
        gain = tried.score - sound.score + fault.presumed
        if gain >= gains.get(fault.name, gain):
            gains[fault.name], likeliest[fault.name] = gain, tried.fits.scores
        worn += [tried] if fault.name == WORN else []
        if found is None or gain > found[0]:
            found = gain, fault, tried
    best, delivered = sound.fits.scores, [one.score for one in worn]
    wear = odds_of_wear(delivered, sound.score)
    if found is not None and (found[0] > GAIN or wear > math.log(LIKELIER)):
        # a search may end short of the best: the sound circuit is asked again from where the faulty one ended, and anew
        _, fault, tried = found
        starts = (tried.fits.best.coordinates, None)
        again = [fit_classes(blocks, sound.actuator, runs=runs, start=start).scores for start in starts]
        best = max([best, *again], key=lambda scores: float(np.max(scores)))
        gains[fault.name] = tried.score - float(np.max(best)) + fault.presumed
        if gains[fault.name] > GAIN:
            return Outside((fault.note,))
        wear = odds_of_wear(delivered, float(np.max(best)))
        if wear > math.log(LIKELIER):
            return Outside((_delivering(DELIVERIES[int(np.argmax(delivered))]),))
    odds = {name: gain - GAIN for name, gain in gains.items() if gain > NOT_EXCLUDED}
    if WORN in odds:
        odds[WORN] = wear
    if STUCK in odds:  # one that never has to open has the likelihood of a sound one, and keeps what is presumed of it
        odds[STUCK] = max(odds[STUCK], min(gains[STUCK], 0.0) + LEFT_UNSEEN)
    pressure = largest_pressure(blocks, sound.fits.best, sound.actuator)
    hidden = odds_of_hidden_relief(pressure, sound.actuator.circuit.relief_pressure) - GAIN
    likeliest[EARLY] = likeliest[EARLY] if odds.get(EARLY, -math.inf) > hidden else best  # none moves what it hides in
    odds[EARLY] = float(np.logaddexp(odds.get(EARLY, -math.inf), hidden))
    chances = probabilities_of(odds)
    # a log that comes near the rig file's setting leaves but a few settings above, and saying so tells little
    told = {name: chance for name, chance in chances.items() if name != EARLY or chance > WORTH_SAYING}
    above = {EARLY: f"{EARLY}, above {1e-5 * pressure:.2g} bar"} if likeliest[EARLY] is best else {}
    open_ = [OpenFault(above.get(name, name), chance, likeliest.get(name, best)) for name, chance in told.items()]
    scores = np.array([best, *(one.fits.scores for one in worn)]) if WORN in odds else None
    return Outside((), not_excluded(open_, best), scores, sum(chances.values()))


def circuits_with_faults(
    blocks: Blocks, fits: ClassFits, actuator: Actuator, gained: float
) -> Iterator[tuple[float, ClassFits]]:
    """Yield circuits with each of the faults that are looked for, fitted to a log without pressure.

    Parameters
    ----------
    blocks : Blocks
        The log in blocks, without pressure.
    fits : ClassFits
        The circuits without a fault that were fitted to it.
    actuator : Actuator
        The healthy actuator.
    gained : float
        Log-likelihood that one must gain on these to be of use [dimensionless]: a search that is sure to end `HOPELESS`
        below that ends early.

    Yields
    ------
    tuple of float and ClassFits
        What is presumed of the fault before a log is seen, a log-likelihood beside that of a sound actuator
        [dimensionless], and the circuits with it.
    """
    runs = nominal_runs(blocks, actuator)
    for fault, tried in _with_each(blocks, sound_circuit(blocks, fits, actuator, runs), runs, HOPELESS - gained):
        yield fault.presumed - GAIN, tried.fits


def gains_of_others(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> Mapping[str, float]:
    """Return the gain of other circuits in explaining a log, with or without pressure.

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
    Mapping[str, float]
        By what a fault is called: log-likelihood of the best circuit with it over that of the best sound one, with what
        is presumed of its size; as `SOUND`, of that one over the rig file's [dimensionless].
    """
    runs = nominal_runs(blocks, actuator)
    sound = sound_circuit(blocks, fits, actuator, runs)
    gains = {SOUND: sound.score - float(np.max(fits.scores))}
    for fault, tried in _with_each(blocks, sound, runs):
        gain = tried.score - sound.score + fault.presumed
        gains[fault.name] = max(gain, gains.get(fault.name, gain))
    return gains


def _with_each(blocks: Blocks, sound: Tried, runs: Array, behind: float = HOPELESS) -> Iterator[tuple[_Fault, Tried]]:
    """Yield each fault, and the circuit with it that explains a log best."""
    for fault in _faults(sound.actuator, largest_pressure(blocks, sound.fits.best, sound.actuator)):
        yield fault, _with(fault, blocks, sound, runs, behind)


def largest_pressure(blocks: Blocks, fit: PointFit, actuator: Actuator) -> float:
    """Return the largest pressure that a fitted circuit comes to in a log without pressure.

    Parameters
    ----------
    blocks : Blocks
        The log.
    fit : PointFit
        The circuit.
    actuator : Actuator
        The actuator around it.

    Returns
    -------
    float
        Mean over a block [Pa].
    """
    seen = replace(blocks, pressure=np.zeros(len(blocks.velocity)))
    rows = parameter_rows(fit.coordinates[None], actuator.circuit, actuator.rated)
    return float(np.max(np.abs(predicted(seen, rows)[0, blocks.first :, 1])))


def _with(fault: _Fault, blocks: Blocks, sound: Tried, runs: Array, behind: float) -> Tried:
    """Return the circuit with a fault that explains a log best, unless it is so far behind the sound one."""
    faulty = replace(sound.actuator, circuit=fault.circuit)
    wanted = LASTING * (behind - sound.score)  # no region holds a circuit better than its misfit says
    if not fault.elsewhere:
        start = sound.fits.best.coordinates
        return Tried(faulty, fit_classes(blocks, faulty, runs=runs, start=start, wanted=wanted))
    runs = nominal_runs(blocks, faulty)
    start = faulty.conditions[int(np.argmin([misfit(blocks, run) for run in runs]))]
    roughly = Tried(faulty, fit_classes(blocks, faulty, runs=runs, start=start, wanted=wanted))
    if roughly.score < sound.score - behind:
        return roughly
    anew = Tried(faulty, fit_classes(blocks, faulty, runs=runs, wanted=wanted))
    return max(roughly, anew, key=lambda one: one.score)


def _delivering(share: float) -> Note:
    return AgainstCode.PUMP_DELIVERS_LESS.note(percent=100.0 * share)


def _faults(actuator: Actuator, pressure: float) -> Iterator[_Fault]:
    """Yield the faults that are looked for, where the sound circuit comes to a pressure [Pa]."""
    sound = actuator.circuit
    for share in DELIVERIES:
        worn = replace(sound, pump_displacement=share * sound.pump_displacement)
        yield _Fault(_delivering(share), WORN, worn, elsewhere=True)
    for share in SETTINGS if 0.0 < pressure < math.inf else ():
        early = replace(sound, relief_pressure=share * pressure)
        yield _Fault(AgainstCode.RELIEF_EARLY.note(), EARLY, early, presumed=SO_SET)
    major = actuator.conditions[list(CONDITIONS).index("major_leakage"), COORDINATES.index("leakage")]
    for side in "ab":
        note = AgainstCode.MAKEUP_STUCK.note(side=side.upper())
        for share in SHUT:
            stuck = one_sided(sound, **{f"makeup_shut_{side}": share})
            yield _Fault(note, STUCK, stuck)
        for size in SEATS:
            leaking = one_sided(sound, **{f"seat_leakage_{side}": size * float(np.exp(major))})
            yield _Fault(AgainstCode.MAKEUP_LEAKS.note(), "a make-up valve that leaks", leaking)
