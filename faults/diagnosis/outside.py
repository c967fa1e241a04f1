"""Faults outside the nine conditions, without pressure: does one explain the log better than any of the nine.

Where pressure is logged, the balance of flows looks for a worn pump and for make-up valves that stick or leak. Without,
circuits with each of them are laid beside those without, and each is weighed over the regions of all nine conditions
(`class_regions`): the logarithm of a Bayes factor. What no rig file knows of a sound circuit may explain more than a
fault does, so the sound circuit is first chosen among some that differ in that.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from faults.conditions import CONDITIONS
from faults.diagnosis.blocks import Blocks
from faults.diagnosis.circuit_runs import COORDINATES
from faults.diagnosis.class_fit import Actuator, misfit, nominal_runs
from faults.diagnosis.class_regions import ClassFits, fit_classes, is_stuck
from faults.notes import AgainstCode, ClassCode
from plant.arrays import Array
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.one_sided import one_sided
from plant.notes import Note

GAIN = 4.0
"""Log-likelihood over all regions that a fault must gain to be believed, in `LASTING` blocks that count as one
[dimensionless]: a Bayes factor of 55."""

NOT_EXCLUDED = -3.0
"""The same, from which a fault is not excluded [dimensionless]: a Bayes factor of a twentieth."""

HOPELESS = 20.0
"""Log-likelihood below the sound circuit at which a rough search leaves a fault [dimensionless]: a thorough one gained
up to 26 on it, but few."""

WORN = "a worn pump"
"""What that fault is called."""

DELIVERIES = (0.7, 0.8, 0.9)
"""Shares of its displacement that a worn pump delivers [dimensionless]."""

SEATS = (0.4, 1.0)
"""Leakage past the seat of a make-up valve, over all the leakage of an actuator with major leakage [dimensionless]."""

WIDER = 5.0
"""By how much wider make-up valves are tried [dimensionless]: no rig file knows them."""


class Outside(NamedTuple):
    """What is said of faults outside the nine conditions.

    Parameters
    ----------
    against : tuple of Note
        The fault that a log shows, which speaks against all nine.
    open : tuple of Note
        The faults that it does not tell.
    worn : ndarray, shape (1 + pumps, 9), optional
        How well each condition holds it with a sound pump, then with one that delivers each of `DELIVERIES`:
        log-likelihoods [dimensionless]; None where a worn pump is excluded.
    """

    against: tuple[Note, ...] = ()
    open: tuple[Note, ...] = ()
    worn: Array | None = None


@dataclass(frozen=True, eq=False)
class _Tried:
    """A circuit, and how well it explains a log within the regions of the nine conditions."""

    actuator: Actuator
    fits: ClassFits

    @property
    def score(self) -> float:
        return float(np.max(self.fits.scores))


@dataclass(frozen=True)
class _Fault:
    """A fault: what is said where it is there, what it is called where it is not excluded, and a circuit with it.

    The search for one that moves the log into another condition begins in that, any other at the sound circuit.
    """

    note: Note
    name: str
    circuit: CircuitParameters
    elsewhere: bool


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
    sound = _sound(blocks, fits, actuator, runs)
    gains, worn = dict[str, float](), [sound.fits.scores]
    found: tuple[float, _Fault, _Tried] | None = None
    for fault in _faults(sound.actuator):
        tried = _with(fault, blocks, sound, runs)
        gain = tried.score - sound.score
        gains[fault.name] = max(gain, gains.get(fault.name, gain))
        worn += [tried.fits.scores] if fault.name == WORN else []
        if found is None or gain > found[0]:
            found = gain, fault, tried
    if found is not None and found[0] > GAIN:
        # a search may end short of the best: the sound circuit is asked again from where the faulty one ended
        _, fault, tried = found
        again = fit_classes(blocks, sound.actuator, runs=runs, start=tried.fits.best.coordinates)
        gains[fault.name] = tried.score - max(sound.score, float(np.max(again.scores)))
        if gains[fault.name] > GAIN:
            return Outside((fault.note,))
    open_ = [name for name, gain in gains.items() if gain > NOT_EXCLUDED]
    note = (ClassCode.NOT_EXCLUDED.note(faults=", ".join(open_)),) if open_ else ()
    return Outside((), note, np.array(worn) if WORN in open_ else None)


def _with(fault: _Fault, blocks: Blocks, sound: _Tried, runs: Array) -> _Tried:
    """Return the circuit with a fault that explains a log best."""
    faulty = replace(sound.actuator, circuit=fault.circuit)
    if not fault.elsewhere:
        return _Tried(faulty, fit_classes(blocks, faulty, runs=runs, start=sound.fits.best.coordinates))
    runs = nominal_runs(blocks, faulty)
    start = faulty.conditions[int(np.argmin([misfit(blocks, run) for run in runs]))]
    roughly = _Tried(faulty, fit_classes(blocks, faulty, runs=runs, start=start))
    if roughly.score < sound.score - HOPELESS:
        return roughly
    return max(roughly, _Tried(faulty, fit_classes(blocks, faulty, runs=runs)), key=lambda one: one.score)


def _sound(blocks: Blocks, fits: ClassFits, actuator: Actuator, runs: Array) -> _Tried:
    """Return the circuit without a fault that explains a log best, among some that differ in what no rig file knows."""
    tried, healthy = [_Tried(actuator, fits)], actuator.circuit
    undrained = replace(healthy, pump_case_leakage=0.0)
    wider = {"makeup_conductance": WIDER * healthy.makeup_conductance}
    for circuit in (undrained, replace(healthy, **wider), replace(undrained, **wider)):
        other = replace(actuator, circuit=circuit)
        tried.append(_Tried(other, fit_classes(blocks, other, runs=runs, start=fits.best.coordinates)))
    return max(tried, key=lambda one: one.score)


def _faults(actuator: Actuator) -> Iterator[_Fault]:
    """Yield the faults that are looked for."""
    sound = actuator.circuit
    for share in DELIVERIES:
        worn = replace(sound, pump_displacement=share * sound.pump_displacement)
        yield _Fault(AgainstCode.PUMP_DELIVERS_LESS.note(percent=100.0 * share), WORN, worn, elsewhere=True)
    major = actuator.conditions[list(CONDITIONS).index("major_leakage"), COORDINATES.index("leakage")]
    for side in "ab":
        stuck = one_sided(sound, **{f"makeup_shut_{side}": 1.0})
        note = AgainstCode.MAKEUP_STUCK.note(side=side.upper())
        yield _Fault(note, "a make-up valve that is stuck shut", stuck, elsewhere=False)
        for size in SEATS:
            leaking = one_sided(sound, **{f"seat_leakage_{side}": size * float(np.exp(major))})
            yield _Fault(AgainstCode.MAKEUP_LEAKS.note(), "a make-up valve that leaks", leaking, elsewhere=False)
