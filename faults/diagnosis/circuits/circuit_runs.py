"""Circuits run under a log's motor speed, and their outputs for the comparison: mean velocity and pressure over blocks.

Eight circuits run side by side in one kernel, so a Gauss-Newton step with all its derivatives costs as much as one run.
"""

from dataclasses import fields, replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from estimation.arrays import IntArray
from estimation.log_checks.channel_names import PRESSURE
from faults.diagnosis.circuits.blocks import Blocks
from plant.arrays import Array
from plant.components.friction import quadratic_friction
from plant.eha.circuit_parameters import CircuitParameters, circuit_values, longest_stroke
from plant.eha.circuit_start import at_rest, pressure_of_force, under_pressure
from plant.eha.model import EhaParameters
from plant.eha.one_sided import circuit_groups, circuit_plant, padded_row
from plant.eha.simulate import CIRCUIT
from plant.solvers.adaptive import LANES, MEANS, SAMPLES, STRAIGHT
from plant.solvers.block_means import block_means
from plant.solvers.steps import parameter_row

COORDINATES = ("leakage", "bias", "friction_rest", "friction_quadratic", "friction_rated", "bulk_modulus", "presliding")
"""Fitted coordinates, as logarithms: leakage coefficient, flow bias, friction force at rest, its quadratic part at
rated velocity, all of it at rated velocity, bulk modulus, and presliding displacement over the rig's. The last is
judged in a rig file and differs from seal to seal; held at a wrong value it would bias friction and leakage."""

PRESLIDING_REACH = 3.0
"""Farthest presliding displacement from the rig's, as a logarithm [dimensionless]: 20 times."""

NEAR_STOP = 0.02
"""A log shows a stop if its piston reversed this near to one, as a share of half the stroke [fraction]."""

SOFTEST_END = 0.01
"""Stiffness of an end that yields most, over what is judged [fraction]; judged."""

TOLERANCES = {"tolerance": 1e-4, "drive_tolerance": 2e-3}
"""Errors allowed in the runs [dimensionless], see `plant.solvers.adaptive.controlled_groups`: far below what
matters."""

LEAST_FLOW = 1e-3
"""Least leakage at the relief setting, and least flow bias, over the rated pump flow [fraction]: a rig file may have
none, and no logarithm starts at zero. Judged: no log can distinguish so little from zero."""

LEAST_FORCE = 1e-3
"""Least friction at rest, quadratic part and whole at rated velocity, over the piston force at the relief setting
[fraction]: a rig file may have none, and no logarithm starts at zero. Judged: 5 N on the paper's actuator, which has
436, 122 and 651 N."""

DRIFT_STEPS = 50
"""Steps in which leakage drifts over a log without pressure: for a factor of two 1.4 % each, a tenth of the difference
between actuators of one kind."""

_WHOLE = slice(None)

COLUMN = {field.name: i for i, field in enumerate(fields(CircuitParameters))}


def coordinates_of(p: EhaParameters, rated: float) -> Array:
    """Return a circuit's coordinates.

    Parameters
    ----------
    rated : float
        Rated velocity [m/s].

    Returns
    -------
    ndarray, shape (7,)
        In the order of `COORDINATES`.
    """
    parts, force = friction_parts(p, rated)
    forces = (max(one, force) for one in parts)
    least = LEAST_FLOW * p.rated_flow
    leakage, bias = max(p.leakage_coefficient, least / p.relief_pressure), max(p.flow_bias, least)
    return np.log([leakage, bias, *forces, p.bulk_modulus, 1.0])


def friction_parts(p: EhaParameters, rated: float) -> tuple[tuple[float, float, float], float]:
    """Return the three parts of friction that are fitted, and the least of each that a logarithm holds.

    Parameters
    ----------
    rated : float
        Rated velocity [m/s].

    Returns
    -------
    tuple of (tuple of float, float)
        Friction at rest, its quadratic part at rated velocity, all of it there; and the least, see `LEAST_FORCE` [N].
    """
    rest, bent = p.friction_coulomb, p.friction_quadratic * rated**2
    return (rest, bent, rest + p.friction_linear * rated + bent), LEAST_FORCE * p.relief_pressure * p.piston_area


def parameter_rows(points: Array, rig: CircuitParameters, rated: float) -> Array:
    """Return the circuits at coordinates, as rows of parameters.

    Parameters
    ----------
    points : ndarray, shape (n, 7)
        Coordinates.
    rig : CircuitParameters
        The circuit around them.
    rated : float
        Rated velocity [m/s].

    Returns
    -------
    ndarray, shape (n, parameters)
        Rows for the circuit plant; the motor follows the logged speed at once.
    """
    rows = np.tile(_row_without_lag(rig), (len(points), 1))
    values = fitted_parameters(points, rig, rated)
    for name, one in values.items():
        rows[:, COLUMN[name]] = one
    leakage = values["leakage_coefficient"]
    share = np.minimum(1.0, leakage / rig.leakage_coefficient) if rig.leakage_coefficient > 0.0 else np.ones(len(rows))
    for name in ("pump_crossport_leakage", "pump_case_leakage"):
        rows[:, COLUMN[name]] *= share
    return rows


def fitted_parameters(points: Array, rig: CircuitParameters, rated: float) -> dict[str, Array]:
    """Return the parameters that are fitted, at coordinates.

    Parameters
    ----------
    points : ndarray, shape (n, 7)
        Coordinates.
    rig : CircuitParameters
        The circuit around them.
    rated : float
        Rated velocity [m/s].

    Returns
    -------
    dict[str, ndarray of shape (n,)]
        By name [SI].
    """
    leakage, bias, rest, bent, full, modulus = np.exp(points[:, :-1].T)
    yielding = np.exp(np.clip(points[:, -1], -PRESLIDING_REACH, PRESLIDING_REACH))
    linear = np.maximum(full - rest - bent, -1.9 * np.sqrt(bent * rest))  # friction must oppose motion at every speed
    return {
        "leakage_coefficient": leakage,
        "flow_bias": bias,
        "friction_quadratic": bent / rated**2,
        "friction_linear": linear / rated,
        "friction_coulomb": rest,
        "bulk_modulus": modulus,
        "presliding_displacement": rig.presliding_displacement * yielding,
    }


@lru_cache(maxsize=16)
def _row_without_lag(rig: CircuitParameters) -> Array:
    """Return the row of a circuit whose motor follows the logged speed at once."""
    return parameter_row(replace(rig, motor_lag=0.0))


def predicted_outputs(blocks: Blocks, rows: Array) -> Array:
    """Return the outputs of circuits under the logged motor speed.

    Parameters
    ----------
    rows : ndarray, shape (m, parameters)
        The circuits.

    Returns
    -------
    ndarray, shape (m, n, outputs)
        Mean velocity [m/s] over each block, and mean pressure [Pa] where it is logged.
    """
    rows = _in_log_coordinates(blocks, rows)[None]
    if blocks.earlier_circuit is not None:
        until, before = blocks.earlier_circuit
        ends = np.broadcast_to(until, rows.shape[1])
        if blocks.leakage_course is None and not np.any(ends % blocks.block):
            some = (slice(first, first + LANES) for first in range(0, len(ends), LANES))
            return np.concatenate([_outputs_with_change(blocks, rows[:, these], ends[these]) for these in some])
        before = padded_row(_in_log_coordinates(blocks, before[None])[0], rows.shape[-1])
        rows = _rows_per_sample(until, before, rows[0], len(blocks.speed))
    if blocks.leakage_course is not None:
        if blocks.pressure is None and len(rows) == 1:
            return _outputs_with_drift(blocks, blocks.leakage_course, rows)
        rows = rows * _drift_factors(blocks.leakage_course, rows.shape[-1])[:, None, :]
    return _run(blocks, _initial_states(blocks, rows[0]), rows)[0]


def _outputs_with_change(blocks: Blocks, rows: Array, ends: IntArray) -> Array:
    """Return the outputs of circuits that each go on from another one at the end of a block, (m, blocks, outputs)."""
    since, before, outputs, state = _run_to_first_change(blocks, rows.shape[-1])
    found, starts = [np.repeat(outputs, len(ends), axis=0)], np.repeat(state, len(ends), axis=0)
    for first, last in pairwise(np.unique([since, *ends, _last_block_end(blocks)]).tolist()):
        here = np.where((ends <= first)[:, None], rows, before)
        outputs, starts = _run(blocks, starts, here, slice(first, last + 1))
        found.append(outputs)
    return np.concatenate(found, axis=1)


@lru_cache(maxsize=2)
def _run_to_first_change(blocks: Blocks, width: int) -> tuple[int, Array, Array, Array]:
    """Return the first change, the circuit before it, its outputs up to there and its state then.

    All circuits after the change begin there, so it is run once.
    """
    until, before = blocks.earlier_circuit or (0, np.empty(0))
    first, row = int(np.min(until)), padded_row(_in_log_coordinates(blocks, before[None])[0], width)[None, None]
    return first, row, *_run(blocks, _initial_states(blocks, row[0]), row, slice(first + 1))


def _last_block_end(blocks: Blocks) -> int:
    return (len(blocks.speed) - 1) // blocks.block * blocks.block


def _run(blocks: Blocks, starts: Array, rows: Array, span: slice = _WHOLE) -> tuple[Array, Array]:
    """Return the outputs of circuits over a span of samples, (m, blocks, outputs), and their states after it."""
    groups = circuit_groups(starts, blocks.speed[span], rows, blocks.sample_time, **_run_tolerances(blocks))
    found, ends, first = list[Array](), list[Array](), 0
    for states in groups:
        last = first + states.shape[2]
        found.append(_outputs(blocks, states, rows[:, first:last]))
        ends.append(states[-1].T)
        first = last
    return found[0] if len(found) == 1 else np.concatenate(found), np.concatenate(ends)


def _run_tolerances(blocks: Blocks) -> dict[str, float]:
    """Return the errors allowed in runs, and how motor speed changes between its samples: it has inertia."""
    if blocks.substeps > 1:  # its straight lines have the means of the curve
        return {**TOLERANCES, "bulge": STRAIGHT}
    return {**TOLERANCES, "bulge": MEANS if blocks.averaged else SAMPLES}


def _outputs_with_drift(blocks: Blocks, course: Array, rows: Array) -> Array:
    """Return the outputs of circuits whose leakage drifts in small steps, shape (m, blocks, outputs).

    Rows of parameters for every sample take some 50 MB and five times as long.
    """
    count = _last_block_end(blocks) // blocks.block
    ends = blocks.block * np.unique(np.linspace(0, count, min(DRIFT_STEPS, count) + 1).astype(np.intp))
    found, starts = list[Array](), _initial_states(blocks, rows[0])
    for first, last in pairwise(ends.tolist()):
        here = rows * _drift_factors(course[[(first + last) // 2]], rows.shape[-1])[:, None, :]
        outputs, starts = _run(blocks, starts, here, slice(first, last + 1))
        found.append(outputs)
    return np.concatenate(found, axis=1)


def _rows_per_sample(until: int | IntArray, before: Array, rows: Array, samples: int) -> Array:
    """Return the parameters per sample if another circuit ran up to a sample, shape (samples, m, parameters)."""
    ends = np.broadcast_to(until, len(rows))
    first, last = int(np.min(ends)), int(np.max(ends))
    found = np.empty((samples, *rows.shape))
    found[:first], found[last:] = before, rows
    between = np.arange(first, last)[:, None] < ends
    found[first:last] = np.where(between[..., None], before, rows)
    return found


def _initial_states(blocks: Blocks, rows: Array) -> Array:
    """Return the initial states of circuits, shape (m, states): at rest, or as the log begins.

    Under a load, rest is at the pressure that holds it: a log that begins at another pressure begins in motion. A log
    without pressure that begins in motion begins with the pressure that the circuit's own friction takes.
    """
    p = circuit_values(rows)
    begun = blocks.raw_start_values if blocks.start_values is None and np.any(p.load_force) else blocks.start_values
    if blocks.start_velocity:
        velocity, law = blocks.start_velocity, (p.friction_quadratic, p.friction_linear, p.friction_coulomb)
        begun = pressure_of_force(quadratic_friction(velocity, np.sign(velocity), *law), p), velocity
    states = at_rest(p) if begun is None else under_pressure(*begun, p)
    found = np.empty((len(rows), len(states)))
    for place, state in enumerate(states):
        found[:, place] = state
    return found


def _drift_factors(course: Array, width: int) -> Array:
    """Return the factors on a circuit's parameters, shape (samples, parameters): viscosity falls as leakage rises."""
    factors = np.ones((len(course), width))
    factors[:, [COLUMN[name] for name in _LEAKAGES]] = course[:, None]
    factors[:, COLUMN["friction_linear"]] = 1.0 / course
    return factors


_LEAKAGES = ("leakage_coefficient", "pump_crossport_leakage", "pump_case_leakage", "cylinder_drain_leakage")


def _in_log_coordinates(blocks: Blocks, rows: Array) -> Array:
    """Return circuits in a log's coordinates: position is relative to its beginning, where a spring may be strained."""
    rows = _with_stops(blocks, rows)
    rows[:, COLUMN["load_force"]] += rows[:, COLUMN["load_stiffness"]] * blocks.place
    return rows


def _with_stops(blocks: Blocks, rows: Array) -> Array:
    """Return circuits with the stops of the rig's stroke if the log may show one, otherwise without stops.

    A piston that reversed before a stop, or passed its place, shows none. A stop found in the log replaces the rig's.
    """
    rows = rows.copy()
    if blocks.stop is not None:
        rows[:, COLUMN["stroke"]] = 2.0 * blocks.stop
        return rows
    half = 0.5 * rows[:, COLUMN["stroke"]]
    shown = np.abs(blocks.reach - half) <= NEAR_STOP * half
    rows[:, COLUMN["end_stop_stiffness"]] = _end_stiffness(blocks, rows, half)
    rows[:, COLUMN["stroke"]] = np.where(shown, 2.0 * half, longest_stroke(circuit_values(rows)))
    return rows


def _end_stiffness(blocks: Blocks, rows: Array, half: Array) -> Array:
    """Return the stiffness of ends that the log shows, by how far pressure drives the piston past them [N/m].

    Ends are no stiffer than judged: those of small actuators may yield far more, with half a chamber's pressure.
    """
    judged = rows[:, COLUMN["end_stop_stiffness"]]
    if blocks.pressure is None or blocks.reach <= np.min(half):
        return judged
    area, load, spring = (rows[:, COLUMN[name]] for name in ("piston_area", "load_force", "load_stiffness"))
    depth = np.abs(blocks.distances[:, None]) - half
    beyond = np.any(depth > 0.0, axis=1) & np.isfinite(blocks.pressure)
    gone, depth = blocks.distances[beyond, None], np.maximum(depth[beyond], 0.0)
    push = np.sign(gone) * (area * blocks.pressure[beyond, None] - load - spring * (blocks.place + gone))
    found = np.sum(push * depth, axis=0) / np.maximum(np.sum(depth**2, axis=0), np.finfo(float).tiny)
    return np.where(np.any(depth > 0.0, axis=0), np.clip(found, SOFTEST_END * judged, judged), judged)


def _outputs(blocks: Blocks, states: Array, rows: Array) -> Array:
    """Return the compared outputs, from states, shape (samples, states, m), and rows, (1 or samples, m, parameters)."""
    velocity = np.diff(states[:: blocks.block, 2], axis=0) / (blocks.block * blocks.sample_time)
    if blocks.pressure is None:
        return np.ascontiguousarray(velocity.T)[..., None]
    whose = circuit_plant(rows.shape[-1]).parameter_class
    logged, rows = states[: -1 : blocks.substeps], rows if len(rows) == 1 else rows[:: blocks.substeps]
    logged, rows = np.ascontiguousarray(logged), np.ascontiguousarray(rows)
    pressure = block_means(CIRCUIT.observe, PRESSURE, logged, rows, blocks.rows, whose)
    return np.stack([velocity.T, pressure.T], axis=-1)
