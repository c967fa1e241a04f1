"""The load on the rod, where a log shows one: what moves the force balance and leaves the flow balance alone.

A constant force on the rod shifts differential pressure by as much as a sensor's offset does, yet no oil leaks for an
offset. So where the flow form explains a log, what shifts its pressures is a load.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from estimation.eha.result import BulkModulusEstimate
from estimation.log_checks.sensor_check import PRESSURE
from faults.notes import AgainstCode
from plant.eha.model import EhaParameters
from plant.log.record import Record

if TYPE_CHECKING:
    from faults.diagnosis.diagnose import Diagnosis

LOADS_TRIED = 3
"""Circuits that are fitted under a load at most: what a bias asks for is read off one linear step."""

ASKING = {AgainstCode.PRESSURE_BIAS, AgainstCode.UNEXPLAINED}
"""What speaks against a circuit that stands under another load than it is told."""


def first_guesses(record: Record, parameters: EhaParameters, estimate: BulkModulusEstimate) -> Iterator[EhaParameters]:
    """Yield the actuator under the loads that a log may show.

    Parameters
    ----------
    record : Record
        The log, with differential pressure.
    parameters : EhaParameters
        The actuator, as its rig file has it.
    estimate : BulkModulusEstimate
        What the flow form found.

    Yields
    ------
    EhaParameters
        As the rig file says; under the load that holds the log's first pressure, if it begins under one; under the load
        that holds its mean pressure.
    """
    found = {} if estimate.explanation is None else estimate.explanation.values
    yield parameters
    if parameters.load_force == 0.0 and "start_pressure" in found:
        yield replace(parameters, load_force=found["start_pressure"][0] * parameters.piston_area)
    yield replace(parameters, load_force=float(np.nanmean(record[PRESSURE])) * parameters.piston_area)


def under_load(
    diagnosed: Callable[[EhaParameters], "Diagnosis"], guesses: Iterator[EhaParameters]
) -> tuple["Diagnosis", EhaParameters]:
    """Return a diagnosis under the load that explains a log.

    Parameters
    ----------
    diagnosed : callable
        ``diagnosed(parameters)``: what the circuit fitted around an actuator says of the log.
    guesses : iterator of EhaParameters
        The actuator, with the loads that are tried first [N].

    Returns
    -------
    tuple of Diagnosis and EhaParameters
        The diagnosis, and the actuator with its load; those of the rig file where no load explains the log.
    """
    tried: list[tuple[Diagnosis, EhaParameters]] = []
    for guess in guesses:
        loaded = guess
        for _ in range(LOADS_TRIED):
            tried.append((diagnosed(loaded), loaded))
            against = tried[-1][0].against
            if not any(note.code in ASKING for note in against):
                return tried[-1]
            biases = [float(note.data["bias_pa"]) for note in against if note.code is AgainstCode.PRESSURE_BIAS]
            if not biases:
                break
            loaded = replace(loaded, load_force=loaded.load_force + biases[0] * loaded.piston_area)
    return tried[0]
