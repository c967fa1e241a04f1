"""Circuits with a fault outside the nine conditions, each fitted to a log beside a sound one."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from faults.conditions import CONDITIONS
from faults.diagnosis.beyond_nine.left_open import DELIVERIES, delivery_log_priors
from faults.diagnosis.beyond_nine.sound_circuit import Trial, largest_pressure
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES
from faults.diagnosis.circuits.class_fit import LASTING, misfit, nominal_runs
from faults.diagnosis.circuits.class_regions import fit_classes
from faults.notes import AgainstCode
from plant.arrays import Array
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.one_sided import with_make_up_faults
from plant.notes import Note

WORN = "a worn pump"
"""Name of that fault."""

EARLY = "a relief valve that opens early"
"""Name of that fault."""

STUCK = "a make-up valve that is stuck shut"
"""Name of that fault. A valve that never has to open leaves no trace."""

SHUT_SHARES = (0.9, 0.97, 0.99, 1.0)
"""Shares of a make-up valve that are blocked [dimensionless]: one that passes a little oil looks like friction beside
one that passes none. A search finds no more than its neighbours."""

SEAT_LEAKAGES = (0.4, 1.0)
"""Leakage past the seat of a make-up valve, over the whole leakage of an actuator with major leakage
[dimensionless]."""

SETTINGS = (0.75, 0.9)
"""Settings of a relief valve, over the largest pressure of the sound circuit in the log [dimensionless]."""

SETTING_LOG_PRIOR = math.log(math.log(SETTINGS[1] / SETTINGS[0]) / math.log(10.0))
"""Prior log-probability of such a setting [dimensionless]: it may be as low as a tenth of the right one, below which no
piston slides, and each of `SETTINGS` stands for those near it."""

HOPELESS = 20.0
"""Log-likelihood below the sound circuit at which a search leaves a fault [dimensionless]: it ends where the steps that
are left would not bring it to that."""

THOROUGH = 8.0
"""The same from which a worn pump is searched roughly alone [dimensionless]: where rough searches ended lower, six
thorough ones in five logs gained 0.2 at most. Long ago some gained up to 26, but few."""


@dataclass(frozen=True)
class Fault:
    """A fault outside the nine conditions, in a circuit.

    Parameters
    ----------
    note : Note
        What a verdict says if a log shows it.
    name : str
        Its name if a log does not exclude it; the same for every size.
    circuit : CircuitParameters
        A circuit with it.
    in_another_condition : bool
        Whether it makes a log look like one in another condition: its search then begins in the condition that fits the
        faulty circuit best, any other search at the sound circuit.
    log_prior : float
        Prior log-probability of its size [dimensionless].
    extra_gain : float
        Log-likelihood that it must gain beyond that of any fault to be believed [dimensionless].
    """

    note: Note
    name: str
    circuit: CircuitParameters
    in_another_condition: bool = False
    log_prior: float = 0.0
    extra_gain: float = 0.0


def fits_with_faults(
    blocks: Blocks, sound: Trial, runs: Array, behind: float = HOPELESS
) -> Iterator[tuple[Fault, Trial]]:
    """Yield each fault, and the circuit with it that explains a log best.

    Parameters
    ----------
    sound : Trial
        The best circuit without a fault.
    runs : ndarray, shape (9, n, outputs)
        Outputs of the nine nominal circuits [m/s].
    behind : float
        Log-likelihood below the sound circuit at which a search ends [dimensionless].

    Yields
    ------
    tuple of Fault and Trial
        From a worn pump to a make-up valve that leaks, in several sizes.
    """
    for fault in _faults(sound.actuator, largest_pressure(blocks, sound.fits.best, sound.actuator)):
        yield fault, _fit_with_fault(fault, blocks, sound, runs, behind)


def _fit_with_fault(fault: Fault, blocks: Blocks, sound: Trial, runs: Array, behind: float) -> Trial:
    """Return the best circuit with a fault, unless it is too far behind the sound one."""
    faulty = replace(sound.actuator, circuit=fault.circuit)
    wanted = LASTING * (behind - sound.score)  # a region's score is never better than the misfit
    if not fault.in_another_condition:
        start = sound.fits.best.coordinates
        return Trial(faulty, fit_classes(blocks, faulty, runs=runs, start=start, wanted=wanted))
    runs = nominal_runs(blocks, faulty)
    start = faulty.conditions[int(np.argmin([misfit(blocks, run) for run in runs]))]
    roughly = Trial(faulty, fit_classes(blocks, faulty, runs=runs, start=start, wanted=wanted))
    if roughly.score < sound.score - behind + HOPELESS - THOROUGH:
        return roughly
    anew = Trial(faulty, fit_classes(blocks, faulty, runs=runs, wanted=wanted))
    return max(roughly, anew, key=lambda one: one.score)


def delivery_note(share: float) -> Note:
    """Return the note on a worn pump.

    Parameters
    ----------
    share : float
        What it delivers of its displacement [fraction].
    """
    return AgainstCode.PUMP_DELIVERS_LESS.note(percent=100.0 * share)


def _faults(actuator: Actuator, pressure: float) -> Iterator[Fault]:
    """Yield the faults that are tested, given the largest pressure of the sound circuit [Pa]."""
    sound = actuator.circuit
    for share in DELIVERIES:
        worn = replace(sound, pump_displacement=share * sound.pump_displacement)
        (presumed,) = delivery_log_priors((share,)).tolist()
        yield Fault(delivery_note(share), WORN, worn, in_another_condition=True, extra_gain=-presumed)
    for share in SETTINGS if 0.0 < pressure < math.inf else ():
        early = replace(sound, relief_pressure=share * pressure)
        yield Fault(AgainstCode.RELIEF_EARLY.note(), EARLY, early, log_prior=SETTING_LOG_PRIOR)
    major = actuator.conditions[list(CONDITIONS).index("major_leakage"), COORDINATES.index("leakage")]
    for side in "ab":
        note = AgainstCode.MAKEUP_STUCK.note(side=side.upper())
        for share in SHUT_SHARES:
            stuck = with_make_up_faults(sound, **{f"makeup_shut_{side}": share})
            yield Fault(note, STUCK, stuck)
        for size in SEAT_LEAKAGES:
            leaking = with_make_up_faults(sound, **{f"seat_leakage_{side}": size * float(np.exp(major))})
            yield Fault(AgainstCode.MAKEUP_LEAKS.note(), "a make-up valve that leaks", leaking)
