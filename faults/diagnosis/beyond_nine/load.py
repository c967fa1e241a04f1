"""The load on the rod, if a log shows one: it changes the force balance and leaves the flow balance alone.

A constant force on the rod shifts differential pressure just as a sensor's offset does, yet no oil leaks because of an
offset. So if the flow form explains a log, a shift of its pressures is a load. The force balance of the sliding piston
determines its size, and a circuit fitted under it must follow the log.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np

from estimation.eha.result import BulkModulusEstimate
from estimation.finding import interval_95
from faults.diagnosis.beyond_nine.force_balance import (
    LEAST_SHARES,
    SURE_DEVIATIONS,
    Loads,
    force_balance,
    friction_prior,
)
from faults.diagnosis.beyond_nine.varying_load import varying_load
from faults.diagnosis.circuit_verdict import Diagnosis
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.class_fit import LASTING, misfit
from faults.notes import AgainstCode, ClassCode
from plant.eha.model import EhaParameters
from plant.notes import Note

LOADS_TRIED = 3
"""Most circuits that are fitted under a load: each bias gives a correction by one linear step."""

LOAD_OBJECTIONS = {AgainstCode.PRESSURE_BIAS, AgainstCode.UNEXPLAINED}
"""Objections to a circuit under a wrong load."""


class LoadedDiagnosis(NamedTuple):
    """A diagnosis under the load that explains a log.

    Parameters
    ----------
    diagnosis : Diagnosis
        Diagnosis by the circuit under the load.
    parameters : EhaParameters
        The actuator with its load; the rig file's if no load explains the log.
    notes : tuple of Note
        The loads by name.
    """

    diagnosis: Diagnosis
    parameters: EhaParameters
    notes: tuple[Note, ...] = ()


DiagnoseAround: TypeAlias = Callable[[EhaParameters, float], Diagnosis]
"""Diagnosis by a circuit fitted around an actuator, given the standard deviation of the force on its rod [N]."""


def with_rod_load(
    diagnosed: DiagnoseAround, parameters: EhaParameters, estimate: BulkModulusEstimate
) -> LoadedDiagnosis:
    """Return a diagnosis under the load that explains a log.

    Parameters
    ----------
    diagnosed : callable
        ``diagnosed(parameters, std)``: diagnosis by a circuit around an actuator, where the constant force on its rod
        has this standard deviation [N].
    parameters : EhaParameters
        The actuator, as its rig file has it.
    estimate : BulkModulusEstimate
        Result of the flow form.

    Returns
    -------
    LoadedDiagnosis
        The diagnosis, and the actuator with its load; those of the rig file where no load explains the log. Where a
        load or friction that changes does, that speaks against all conditions.
    """
    first = diagnosed(parameters, 0.0)
    blocks = first.scoreboard.blocks
    seen, asks = force_balance(blocks, parameters), _suggests_load(first)
    names = () if seen is None else seen.certain if asks else seen.significant
    guesses: Iterable[EhaParameters] = ()
    if seen is not None and names:
        guesses = [with_loads(parameters, seen, names)]
    elif asks and _allows_force(seen, blocks, parameters):
        guesses = first_guesses(blocks, parameters, estimate, seen)
    found = _first_following(diagnosed, guesses, seen, parameters)
    if found is not None and (asks or _follows_better(found.diagnosis, first)):
        return found
    left = any(note.code is AgainstCode.UNEXPLAINED for note in first.against)
    varies = varying_load(blocks, parameters) if left else None
    return LoadedDiagnosis(first if varies is None else replace(first, against=(varies, *first.against)), parameters)


def with_loads(p: EhaParameters, seen: Loads, names: Sequence[str]) -> EhaParameters:
    """Return an actuator with loads from the force balance.

    Parameters
    ----------
    p : EhaParameters
        The actuator, as its rig file has it.
    seen : Loads
        Loads that the force balance shows beyond the rig file.
    names : sequence of str
        Which of these loads.
    """
    return replace(p, **{name: getattr(p, name) + seen.of(name)[0] for name in names})


def first_guesses(
    blocks: Blocks, parameters: EhaParameters, estimate: BulkModulusEstimate, seen: Loads | None
) -> Iterator[EhaParameters]:
    """Yield the actuator under each load that a log may show and the force balance is not certain of.

    Parameters
    ----------
    blocks : Blocks
        The log, with pressure.
    parameters : EhaParameters
        The actuator, as its rig file has it.
    estimate : BulkModulusEstimate
        Result of the flow form.
    seen : Loads or None
        Loads that the force balance shows.

    Yields
    ------
    EhaParameters
        Under the likeliest constant force by that balance; under the load that holds the log's first pressure, if it
        begins under one; under the load that holds its mean pressure.
    """
    if seen is not None:
        yield with_loads(parameters, seen, ["load_force"])
    found = {} if estimate.explanation is None else estimate.explanation.values
    if parameters.load_force == 0.0 and "start_pressure" in found:
        yield replace(parameters, load_force=found["start_pressure"][0] * parameters.piston_area)
    if blocks.pressure is not None:
        yield replace(parameters, load_force=float(np.nanmean(blocks.pressure)) * parameters.piston_area)


def _first_following(
    diagnosed: DiagnoseAround,
    guesses: Iterable[EhaParameters],
    seen: Loads | None,
    rig: EhaParameters,
) -> LoadedDiagnosis | None:
    """Return the first load under which a circuit follows the log, each corrected by the remaining bias."""
    std = _force_and_std(seen, rig)[1]
    for guess in guesses:
        loaded = guess
        for _ in range(LOADS_TRIED):
            found = diagnosed(loaded, std if loaded.load_force != rig.load_force else 0.0)
            if not _suggests_load(found):
                return _with_load_notes(found, loaded, seen, rig)
            biases = [float(note.data["bias_pa"]) for note in found.against if note.code is AgainstCode.PRESSURE_BIAS]
            if not biases:
                break
            loaded = replace(loaded, load_force=loaded.load_force + biases[0] * loaded.piston_area)
    return None


def _with_load_notes(
    found: Diagnosis, loaded: EhaParameters, seen: Loads | None, rig: EhaParameters
) -> LoadedDiagnosis | None:
    """Return a diagnosis with its loads by name; None if the force balance contradicts them."""
    more = loaded.load_force - rig.load_force
    force, std = _force_and_std(seen, rig)
    if seen is not None and more != 0.0 and abs(more - force) > SURE_DEVIATIONS * std:
        return None
    notes: list[Note] = []
    if more != 0.0:
        value, (low, high) = loaded.load_force, interval_95(loaded.load_force, std)
        bias = value / loaded.piston_area
        notes.append(ClassCode.LOAD_ON_ROD.note(force_n=value, low=low, high=high, pressure_pa=bias))
    if seen is not None and (value := loaded.load_stiffness) != rig.load_stiffness:
        low, high = interval_95(value, seen.of("load_stiffness")[1])
        notes.append(ClassCode.SPRING_ON_ROD.note(value=value, low=low, high=high, rig=rig.load_stiffness))
    if seen is not None and (value := loaded.moving_mass) != rig.moving_mass:
        low, high = interval_95(value, seen.of("moving_mass")[1])
        notes.append(ClassCode.MASS_ON_ROD.note(value=value, low=low, high=high, rig=rig.moving_mass))
    return LoadedDiagnosis(found, loaded, tuple(notes))


def _suggests_load(found: Diagnosis) -> bool:
    return any(note.code in LOAD_OBJECTIONS for note in found.against)


def _follows_better(found: Diagnosis, first: Diagnosis) -> bool:
    """Return whether a circuit under a load follows a log better than one without, without further objections."""
    (under, loaded), (free, without) = ((one.scoreboard.blocks, one.scoreboard.fits) for one in (found, first))
    if len(found.against) > len(first.against):
        return False
    if not np.array_equal(under.counts, free.counts):
        return True
    return misfit(under, loaded.best.fitted) < misfit(free, without.best.fitted) - LASTING


def _allows_force(seen: Loads | None, blocks: Blocks, p: EhaParameters) -> bool:
    """Return whether the force balance allows a constant force that matters."""
    if seen is None or blocks.pressure is None:
        return True
    size = p.piston_area * float(np.sqrt(np.nanmean(blocks.pressure**2)))
    return SURE_DEVIATIONS * seen.of("load_force")[1] > LEAST_SHARES["load_force"] * size


def _force_and_std(seen: Loads | None, p: EhaParameters) -> tuple[float, float]:
    """Return the constant force and its standard deviation [N]; friction holds a sticking piston either way."""
    if seen is not None:
        return seen.of("load_force")
    rest, spread = (one[0] for one in friction_prior(p))
    return 0.0, float(rest + spread)
