"""Without pressure: the sound circuit that explains a log best, among some that differ in what no rig file states.

A rig file says little about make-up valves and the drain from the pump's case. What these explain is no fault, and a
log that they explain is explained.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import LASTING, PointFit, nominal_runs
from faults.diagnosis.circuits.class_regions import ClassFits, fit_classes
from faults.diagnosis.circuits.out_of_model import unexplained_notes
from plant.arrays import Array

MAKEUP_FACTOR = 5.0
"""Factor by which wider make-up valves are tried [dimensionless]: no rig file states them."""

FOLLOWED_RESIDUAL = 0.005
"""Residual over the velocity, root mean square, up to which circuits follow a log equally well [dimensionless]: the
best sound circuit leaves less in one of ten plain training logs of the open benchmark, 1.6 % in the median."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A circuit, and how well it explains a log within the regions of the nine conditions.

    Parameters
    ----------
    actuator : Actuator
        What it is fitted around.
    fits : ClassFits
        The fit.
    """

    actuator: Actuator
    fits: ClassFits

    @property
    def score(self) -> float:
        """Log-likelihood of the condition that fits it best [dimensionless]."""
        return float(np.max(self.fits.scores))


def log_likelihood(blocks: Blocks, tried: Trial) -> float:
    """Return how well a circuit explains a log, if circuits are no more exact than `FOLLOWED_RESIDUAL`.

    Parameters
    ----------
    blocks : Blocks
        The log in blocks, without pressure.
    tried : Trial
        The circuit.

    Returns
    -------
    float
        Its score, residuals below `FOLLOWED_RESIDUAL` counted as that [dimensionless].
    """
    finer = np.fmax(1.0, FOLLOWED_RESIDUAL * blocks.rms / tried.fits.best.scales)
    return tried.score - float(blocks.counts @ np.log(finer)) / LASTING


def sound_circuit(blocks: Blocks, fits: ClassFits, actuator: Actuator, runs: Array) -> Trial:
    """Return the best circuit without a fault, among some that differ in what no rig file states.

    Parameters
    ----------
    blocks : Blocks
        The log in blocks, without pressure.
    fits : ClassFits
        The circuits fitted to it around the actuator.
    actuator : Actuator
        The healthy actuator.
    runs : ndarray, shape (9, n, outputs)
        Outputs of its nine nominal circuits [m/s].

    Returns
    -------
    Trial
        That circuit: the actuator's, one without a drain from the pump's case, with wider make-up valves, or both.
    """
    tried, healthy = [Trial(actuator, fits)], actuator.circuit
    start = at_determined_scale(blocks, fits.best, actuator).coordinates
    undrained = replace(healthy, pump_case_leakage=0.0)
    wider = {"makeup_conductance": MAKEUP_FACTOR * healthy.makeup_conductance}
    for circuit in (undrained, replace(healthy, **wider), replace(undrained, **wider)):
        other = replace(actuator, circuit=circuit)
        tried.append(Trial(other, fit_classes(blocks, other, runs=runs, start=start)))
    best = max(tried, key=lambda one: one.score)
    told = at_determined_scale(blocks, best.fits.best, best.actuator)
    return best if told is best.fits.best else replace(best, fits=replace(best.fits, best=told))


def at_determined_scale(blocks: Blocks, fit: PointFit, actuator: Actuator) -> PointFit:
    """Return a circuit at the scale that a log without pressure determines, if its relief valve opened as it ran.

    Parameters
    ----------
    blocks : Blocks
        The log in blocks, without pressure.
    fit : PointFit
        The circuit, at its likeliest scale.
    actuator : Actuator
        The actuator around it.

    Returns
    -------
    PointFit
        As it ran; unchanged if its relief valve stayed shut, since motion then determines no scale.
    """
    if fit.run_coordinates is None:
        return fit
    opened = largest_pressure(blocks, fit.as_run, actuator) >= actuator.circuit.relief_pressure
    return fit.as_run if opened else fit


@lru_cache(maxsize=4)
def largest_pressure(blocks: Blocks, fit: PointFit, actuator: Actuator) -> float:
    """Return the largest pressure that a fitted circuit reaches in a log without pressure.

    Parameters
    ----------
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
    return float(np.max(np.abs(predicted_outputs(seen, rows)[0, blocks.first :, 1])))


def another_sound_circuit(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> Actuator | None:
    """Return a healthy actuator that follows a log closely enough, if the rig file's does not.

    Parameters
    ----------
    blocks : Blocks
        The log.
    fits : ClassFits
        The circuits fitted to it around the actuator.
    actuator : Actuator
        The healthy actuator of the rig file.

    Returns
    -------
    Actuator or None
        One that differs in what no rig file states, such as the width of its make-up valves; None if that does not
        help, and with pressure, since a flow balance fits such parameters.
    """
    if blocks.pressure is not None:
        return None
    sound = sound_circuit(blocks, fits, actuator, nominal_runs(blocks, actuator))
    return None if unexplained_notes(blocks, sound.fits, sound.actuator) else sound.actuator
