"""`with_fitted_accumulator(found, again)`: a single rod whose inner circuit has less or more gas than assumed.

Few rig files state the gas of the inner circuit's accumulator. A single rod takes oil from it at every stroke and
returns it. With little gas its pressure, which acts on the low side of the piston, varies by several bar. The flow
balance is hardly affected, but the force on the piston is: circuits with another accumulator left a fifth to a third of
the velocity of such logs.
"""

from collections.abc import Callable
from dataclasses import replace
from operator import attrgetter

import numpy as np

from faults.conditions import CONDITIONS
from faults.diagnosis.beyond_nine.load import LoadedDiagnosis
from faults.diagnosis.circuits.actuator import Actuator, actuator_of
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COLUMN, parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import LASTING, PointFit, fit_freely, misfit
from faults.diagnosis.circuits.class_regions import ClassFits
from faults.diagnosis.circuits.out_of_model import unexplained_notes
from plant.eha.circuit_parameters import CircuitParameters, oil_demand
from plant.eha.model import EhaParameters

TRIED, ROUNDS, PASSES = 8, 2, 3
"""Accumulators that are run side by side; rounds, each between the neighbours of the best; and most fits of a circuit
with the best [count]."""

LARGEST_GAS = 30.0
"""Most gas that is tried, over the assumed gas [dimensionless]: its pressure is then constant."""

GAS_FACTOR = 2.0
"""Factor by which more or less gas is tried once a circuit was fitted with some [dimensionless]."""


def with_fitted_accumulator(
    found: LoadedDiagnosis, again: Callable[[EhaParameters], LoadedDiagnosis]
) -> LoadedDiagnosis:
    """Return a diagnosis with the accumulator under which a circuit follows the log of a single rod.

    Parameters
    ----------
    found : LoadedDiagnosis
        A diagnosis, and the actuator around which circuits were fitted.
    again : callable
        ``again(parameters)``: the diagnosis around another actuator.

    Returns
    -------
    LoadedDiagnosis
        Unchanged if a circuit follows the log already, or none does with another accumulator.
    """
    if found.diagnosis.circuit_follows or not found.parameters.single_rod:
        return found
    board = found.diagnosis.scoreboard
    fed = fit_accumulator(board.blocks, board.fits, actuator_of(found.parameters))
    if fed is None:
        return found
    other = again(fed)
    return other if other.diagnosis.circuit_follows else found


def fit_accumulator(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> CircuitParameters | None:
    """Return the healthy circuit with an accumulator under which circuits follow the log, if they do not otherwise.

    Parameters
    ----------
    blocks : Blocks
        The log.
    fits : ClassFits
        The circuits fitted to it around the actuator.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    CircuitParameters or None
        None without pressure, since valves and accumulator then cannot be told apart, and if no accumulator helps.
    """
    if blocks.pressure is None:
        return None
    nearest, fed, best = list(CONDITIONS)[int(np.argmax(fits.scores))], actuator, fits.best
    ends = oil_demand(actuator.circuit), LARGEST_GAS * actuator.circuit.accumulator_gas
    for _ in range(PASSES):
        gas, left = _likeliest_gas(blocks, fed, best, ends)
        if not left < misfit(blocks, best.fitted) - LASTING:
            break
        fed = replace(fed, circuit=replace(fed.circuit, accumulator_gas=gas))
        best = min(
            (fit_freely(blocks, fed, nearest, start) for start in (None, best.coordinates)), key=attrgetter("cost")
        )
        ends = gas / GAS_FACTOR, gas * GAS_FACTOR
    return None if fed is actuator or unexplained_notes(blocks, replace(fits, best=best), fed) else fed.circuit


def _likeliest_gas(blocks: Blocks, actuator: Actuator, fit: PointFit, ends: tuple[float, float]) -> tuple[float, float]:
    """Return the gas between two ends with which a fitted circuit follows a log best [m^3], and its residual."""
    circuit = actuator.circuit
    rows = np.repeat(parameter_rows(fit.coordinates[None], circuit, actuator.rated), TRIED, axis=0)
    gas, left = 0.0, np.inf
    for _ in range(ROUNDS):
        tried = np.geomspace(*ends, TRIED)
        rows[:, COLUMN["accumulator_gas"]] = tried
        misfits = [misfit(blocks, run) for run in predicted_outputs(blocks, rows)]
        place = int(np.argmin(misfits))
        gas, left = float(tried[place]), misfits[place]
        ends = tried[max(place - 1, 0)], tried[min(place + 1, TRIED - 1)]
    return gas, left
