"""Without pressure: a load on the rod that the rig file does not state, as an alternative to an offset of motor speed.

Both make a leaking piston move further in one direction. If an offset explains a log better than none, circuits with a
constant force and with a spring on the rod are fitted as well. Other logs need no extra time.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import LASTING, WEAK_PRIOR, PointFit, fit_freely, normalised_rows
from faults.diagnosis.circuits.yielding import follows_velocity
from faults.notes import AgainstCode
from plant.eha.circuit_parameters import CircuitParameters
from plant.notes import Note

NAMED_ALONE_GAIN = math.log(10.0)
"""Log-likelihood by which one of two explanations must be better to be named alone [dimensionless], in `LASTING` blocks
that count as one: evidence is called strong above that (Jeffreys, Theory of Probability, 1961, appendix B)."""

ROUNDS = 2
"""Most linear steps towards a load: a second one gained up to a tenth more."""

NUDGE = 0.02
"""Finite-difference step, over the prior standard deviation of a load [dimensionless]."""


@dataclass(frozen=True)
class _Load:
    """A load by its entry in a rig file: its name, its unit, and its prior standard deviation [same unit]."""

    entry: str
    name: str
    unit: str
    prior_std: float


def load_for_offset(
    blocks: Blocks, actuator: Actuator, nearest: str, without: PointFit, offset: float, gain: float
) -> Note | None:
    """Return the note that replaces an offset of motor speed if a load on the rod explains a log as well.

    Parameters
    ----------
    blocks : Blocks
        The log, without pressure.
    nearest : str
        The nearest condition.
    without : PointFit
        The circuit that was fitted freely without an offset.
    offset : float
        Correction of the logged motor speed [rad/s].
    gain : float
        Its gain in log-likelihood [dimensionless].

    Returns
    -------
    Note or None
        A load alone if it is ten times likelier; both if neither is; None if the offset is, or if no circuit under a
        load follows the log.
    """
    force = actuator.circuit.piston_area * actuator.circuit.relief_pressure
    loads = (
        _Load("load_force", "a constant load", "N", force),
        _Load("load_stiffness", "a spring", "N/m", force / max(blocks.travel, np.finfo(float).eps)),
    )
    found = [(*_fit_load(one, blocks, actuator, nearest, without), one) for one in loads]
    gained, size, fit, load = max(found, key=lambda one: one[0])
    gained -= gain * LASTING
    if gained < -NAMED_ALONE_GAIN * LASTING or not follows_velocity(blocks, fit, actuator):
        return None
    told = {"load": load.name, "entry": load.entry, "value": size, "unit": load.unit}
    if gained > NAMED_ALONE_GAIN * LASTING:
        return AgainstCode.LOAD_UNTOLD.note(**told)
    return AgainstCode.LOAD_OR_OFFSET.note(**told, bias_rad_s=-offset)


def _fit_load(
    load: _Load, blocks: Blocks, actuator: Actuator, nearest: str, without: PointFit
) -> tuple[float, float, PointFit]:
    """Return the gain in log-likelihood under a load, its entry in the rig file [SI], and the circuit."""
    rig = float(getattr(actuator.circuit, load.entry))

    def under(value: float) -> CircuitParameters:
        return replace(actuator.circuit, **{load.entry: value})

    gained, value, fit = 0.0, rig, without
    for _ in range(ROUNDS):
        further = value + _load_step(lambda step, at=value: under(at + step), load.prior_std, blocks, actuator, fit)
        if load.entry == "load_stiffness" and further < 0.0:
            break
        tried = fit_freely(blocks, replace(actuator, circuit=under(further)), nearest, start=fit.coordinates)
        if not without.cost - tried.cost > gained:
            break
        gained, value, fit = without.cost - tried.cost, further, tried
    return gained, value, fit


def _load_step(
    moved: Callable[[float], CircuitParameters], presumed: float, blocks: Blocks, actuator: Actuator, fit: PointFit
) -> float:
    """Return the linear step of a load from a circuit, with all other coordinates free [unit of the load]."""
    rows = parameter_rows(fit.coordinates[None], moved(NUDGE * presumed), actuator.rated)
    slopes = np.concatenate([fit.slopes, (predicted_outputs(blocks, rows) - fit.fitted) / NUDGE])
    weighted, left = normalised_rows(blocks, fit, slopes)
    pull = np.eye(len(slopes)) * LASTING
    pull[: len(WEAK_PRIOR), : len(WEAK_PRIOR)] = LASTING * np.linalg.inv(WEAK_PRIOR)
    return presumed * float(np.linalg.solve(weighted @ weighted.T + pull, weighted @ left)[-1])
