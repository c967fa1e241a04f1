"""Circuits run under a log's motor speed, and what is compared with the log: mean velocity and pressure over blocks.

What is compared is coarse on purpose: the mean velocity and the mean pressure over blocks of 10 ms, whatever the log's
sample rate, so that encoder, differentiation and pressure noise hardly count and the log's length alone sets the cost.
Eight circuits run side by side in one kernel, so a Gauss-Newton step with all its derivatives costs one of them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache

import numpy as np

from estimation.arrays import IntArray
from estimation.eha.explained import LEAKAGE_COURSE
from estimation.log_checks.bridging import bridged
from estimation.log_checks.measurement_noise import measurement_variances, position_variance
from estimation.log_checks.sensor_check import PRESSURE
from plant.arrays import Array
from plant.eha.circuit_parameters import CircuitParameters, circuit_values, longest_stroke
from plant.eha.circuit_start import under_pressure
from plant.eha.model import EhaParameters
from plant.eha.one_sided import as_wide, circuit_plant, run_circuits
from plant.eha.simulate import CIRCUIT
from plant.errors import LogError
from plant.log.record import Record
from plant.solvers.block_means import block_means
from plant.solvers.steps import parameter_row

COORDINATES = ("leakage", "bias", "friction_rest", "friction_quadratic", "friction_rated", "bulk_modulus", "presliding")
"""What is fitted, as logarithms of: leakage coefficient, flow bias, friction force at rest, its quadratic part at rated
velocity, all of it at rated velocity, bulk modulus, and presliding displacement over the rig's. The last is judged and
differs from seal to seal; held where it is wrong, it bends friction and leakage."""

PRESLIDING_REACH = 3.0
"""Farthest that presliding displacement is taken from the rig's, as a logarithm [dimensionless]: 20 times."""

BLOCK = 0.01
"""Time over which velocity and pressure are averaged [s]."""

SETTLING = 0.1
"""Time at the start that does not count [s]: the circuit starts at rest, a log need not."""

LONGEST = 30.0
"""Longest stretch of a log that is simulated [s]."""

RATE = 1e-3
"""Sample time to which faster logs are averaged [s]."""

LEAST_BEGUN = 0.1
"""Share of a log's pressure, root mean square, from which what it begins with is more than noise [fraction]."""

AT_STOP = 0.02
"""A log shows a stop if its piston turned this near to one, as a share of half the stroke [fraction]."""

ALLOWED = {"tolerance": 1e-4, "drive_tolerance": 2e-3}
"""Errors allowed in the runs [dimensionless], see `plant.solvers.adaptive.controlled_run`: far below what counts."""

COLUMN = {field.name: i for i, field in enumerate(fields(CircuitParameters))}


@dataclass(frozen=True, eq=False)
class Blocks:
    """A log as it is compared with a model.

    Parameters
    ----------
    speed : ndarray, shape (samples,)
        Motor speed [rad/s], whole.
    sample_time : float
        Time between its samples [s].
    block : int
        Samples in a block.
    velocity : ndarray, shape (n,)
        Mean velocity over each block [m/s]; NaN where unknown.
    pressure : ndarray, shape (n,), or None
        Mean differential pressure over each block [Pa], None where it is not logged.
    noise : ndarray, shape (outputs,)
        Standard deviation of what the sensors add to velocity [m/s] and pressure [Pa].
    earlier : tuple of int or ndarray, shape (circuits,), and ndarray, shape (parameters,), or None
        Another circuit that ran up to a sample, or up to one before each circuit, as a row of parameters; None if one
        ran throughout.
    course : ndarray, shape (samples,), or None
        Leakage over what it is when the log ends [dimensionless]; None where it does not change.
    stop : float or None
        How far from where the log begins the piston ran into a stop [m]; None where only the rig knows of stops.
    begun : tuple of float, or None
        Differential pressure [Pa] and velocity [m/s] with which the log begins; None at rest, and where it is not told.
    """

    speed: Array
    sample_time: float
    block: int
    velocity: Array
    pressure: Array | None
    noise: Array
    earlier: tuple[int | IntArray, Array] | None = None
    course: Array | None = None
    stop: float | None = None
    begun: tuple[float, float] | None = None

    @property
    def outputs(self) -> Array:
        """What is measured, shape (n, outputs): velocity [m/s], and pressure [Pa] if there is one."""
        return np.column_stack([self.velocity] if self.pressure is None else [self.velocity, self.pressure])

    @property
    def travel(self) -> float:
        """How far the piston moves to and fro [m]."""
        return float(np.ptp(np.cumsum(np.nan_to_num(self.velocity)))) * self.block * self.sample_time

    @property
    def reach(self) -> float:
        """How far the piston goes from where the log begins [m], to either side."""
        gone = np.cumsum(np.nan_to_num(self.velocity)) * self.block * self.sample_time
        return float(np.max(np.abs(gone), initial=0.0))

    @property
    def first(self) -> int:
        """First block that counts."""
        return round(SETTLING / (self.block * self.sample_time))


def blocks_of(record: Record) -> Blocks:
    """Return a log in blocks.

    Parameters
    ----------
    record : Record
        A log with motor speed, and position or velocity.

    Returns
    -------
    Blocks
        Means over `BLOCK`, of `LONGEST` at most.

    Raises
    ------
    LogError
        If neither position nor velocity is logged, or the log is shorter than `SETTLING` and a few blocks.
    """
    pooled = max(1, round(RATE / record.sample_time))
    record = record.slice(0, round(LONGEST / record.sample_time) + 1)
    sample_time = pooled * record.sample_time
    block = max(2, round(BLOCK / sample_time))
    count = (len(record) // pooled - 1) // block
    if count * block * sample_time < 2.0 * SETTLING or count < 8:
        raise LogError(
            f"a diagnosis needs a log of 8 blocks of {block * sample_time:g} s or more, got {record.duration:g} s"
        )
    whole = {name: _pooled(record[name], pooled)[: count * block + 1] for name in record if name in _NEEDED}
    if "position_m" in whole and np.any(np.isfinite(whole["position_m"])):
        velocity = np.diff(bridged(whole["position_m"])[::block]) / (block * sample_time)
    elif "velocity_m_s" in whole and np.any(np.isfinite(whole["velocity_m_s"])):
        velocity = _mean(whole["velocity_m_s"], block)
    else:
        raise LogError(f"velocity_m_s or position_m is needed; the log has {', '.join(record)}")
    pressure = whole.get("differential_pressure_pa")
    if pressure is not None:
        pressure = _mean(pressure, block)
        if not np.any(np.isfinite(pressure[round(SETTLING / (block * sample_time)) :])):
            pressure = None  # a sensor that was out for all of the stretch
            del whole["differential_pressure_pa"]
    speed = bridged(whole["motor_speed_rad_s"])
    noise, course, begun = _noise(whole, block, sample_time), whole.get(LEAKAGE_COURSE), _begun(whole, velocity)
    return Blocks(speed, sample_time, block, velocity, pressure, noise, course=course, begun=begun)


def _begun(whole: Mapping[str, Array], velocity: Array) -> tuple[float, float] | None:
    """Return pressure and velocity at the start of a log that does not begin at rest."""
    pressure = whole.get("differential_pressure_pa", np.zeros(1))
    size = float(np.sqrt(np.nanmean(pressure**2)))
    return (float(pressure[0]), float(np.nan_to_num(velocity[0]))) if abs(pressure[0]) > LEAST_BEGUN * size else None


def _noise(whole: Mapping[str, Array], block: int, sample_time: float) -> Array:
    """Return the white noise of the channels as it is left in the blocks."""
    record, velocity, pressure = Record(sample_time, whole), "velocity_m_s", "differential_pressure_pa"
    if "position_m" in whole:
        noise = [(2.0 * position_variance(whole["position_m"])) ** 0.5 / (block * sample_time)]
    else:
        noise = [(measurement_variances(record, [velocity])[velocity] / block) ** 0.5]
    if pressure in whole:
        noise.append((measurement_variances(record, [pressure])[pressure] / block) ** 0.5)
    return np.array(noise)


_NEEDED = ("motor_speed_rad_s", "position_m", "velocity_m_s", "differential_pressure_pa", LEAKAGE_COURSE)


def _pooled(values: Array, pooled: int) -> Array:
    return values if pooled == 1 else _mean(values, pooled, spare=0)


def _mean(values: Array, block: int, spare: int = 1) -> Array:
    """Return the means of blocks over the samples that are there; NaN where more than half are missing.

    What a clipped sensor left out is not like what it kept: the mean of a small rest would lie off.
    """
    count = (len(values) - spare) // block
    parts = values[: count * block].reshape(count, block)
    there = np.isfinite(parts)
    if np.all(there):
        return parts.mean(axis=1)
    seen = there.sum(axis=1)
    return np.where(2 * seen >= block, np.where(there, parts, 0.0).sum(axis=1) / np.maximum(seen, 1), np.nan)


def coordinates_of(p: EhaParameters, rated: float) -> Array:
    """Return a circuit's coordinates.

    Parameters
    ----------
    p : EhaParameters
        The actuator.
    rated : float
        Rated velocity [m/s].

    Returns
    -------
    ndarray, shape (7,)
        In the order of `COORDINATES`.
    """
    a1, a2, a3 = p.friction_quadratic, p.friction_linear, p.friction_coulomb
    forces = a3, a1 * rated**2, a3 + a2 * rated + a1 * rated**2
    return np.log([p.leakage_coefficient, p.flow_bias, *forces, p.bulk_modulus, 1.0])


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
    leakage, bias, rest, bent, full, modulus = np.exp(points[:, :-1].T)
    yielding = np.exp(np.clip(points[:, -1], -PRESLIDING_REACH, PRESLIDING_REACH))
    linear = np.maximum(full - rest - bent, -1.9 * np.sqrt(bent * rest))  # friction must oppose motion at every speed
    rows = np.tile(_at_once(rig), (len(points), 1))
    for name, values in (
        ("leakage_coefficient", leakage),
        ("flow_bias", bias),
        ("friction_quadratic", bent / rated**2),
        ("friction_linear", linear / rated),
        ("friction_coulomb", rest),
        ("bulk_modulus", modulus),
        ("presliding_displacement", rig.presliding_displacement * yielding),
    ):
        rows[:, COLUMN[name]] = values
    share = np.minimum(1.0, leakage / rig.leakage_coefficient) if rig.leakage_coefficient > 0.0 else np.ones(len(rows))
    for name in ("pump_crossport_leakage", "pump_case_leakage"):
        rows[:, COLUMN[name]] *= share
    return rows


@lru_cache(maxsize=16)
def _at_once(rig: CircuitParameters) -> Array:
    """Return the row of a circuit whose motor follows the logged speed at once."""
    return parameter_row(replace(rig, motor_lag=0.0))


def predicted(blocks: Blocks, rows: Array) -> Array:
    """Return what circuits do under the logged motor speed.

    Parameters
    ----------
    blocks : Blocks
        The log.
    rows : ndarray, shape (m, parameters)
        The circuits.

    Returns
    -------
    ndarray, shape (m, n, outputs)
        Mean velocity [m/s] over each block, and mean pressure [Pa] where it is logged.
    """
    rows = _between_stops(blocks, rows)[None]
    if blocks.earlier is not None:
        until, before = blocks.earlier
        before = as_wide(_between_stops(blocks, before[None])[0], rows.shape[-1])
        rows = _after(until, before, rows[0], len(blocks.speed))
    if blocks.course is not None:
        rows = rows * _drift(blocks.course, rows.shape[-1])[:, None, :]
    starts = np.array([_start(blocks, row) for row in rows[0]])
    runs = run_circuits(starts, blocks.speed, rows, blocks.sample_time, **ALLOWED)
    return _outputs(blocks, np.moveaxis(runs, 0, 2), rows)  # as they lie in memory


def _after(until: int | IntArray, before: Array, rows: Array, samples: int) -> Array:
    """Return what circuits are at each sample if another one ran up to a sample, shape (samples, m, parameters)."""
    ends = np.broadcast_to(until, len(rows))
    first, last = int(np.min(ends)), int(np.max(ends))
    found = np.empty((samples, *rows.shape))
    found[:first], found[last:] = before, rows
    between = np.arange(first, last)[:, None] < ends
    found[first:last] = np.where(between[..., None], before, rows)
    return found


def _start(blocks: Blocks, row: Array) -> Array:
    """Return the state in which a circuit begins: at rest, or as the log does."""
    begun = None if blocks.begun is None else under_pressure(*blocks.begun, circuit_values(row))
    return CIRCUIT.start(row) if begun is None else np.array(begun, dtype=np.float64)


def _drift(course: Array, width: int) -> Array:
    """Return the factors on a circuit's parameters, shape (samples, parameters): viscosity falls as leakage rises."""
    factors = np.ones((len(course), width))
    factors[:, [COLUMN[name] for name in _LEAKAGES]] = course[:, None]
    factors[:, COLUMN["friction_linear"]] = 1.0 / course
    return factors


_LEAKAGES = ("leakage_coefficient", "pump_crossport_leakage", "pump_case_leakage", "cylinder_drain_leakage")


def _between_stops(blocks: Blocks, rows: Array) -> Array:
    """Return circuits with the stops of the rig's stroke where the log may show one, without stops elsewhere.

    A piston that turned back before it came to a stop, or that went past it, shows none. A stop that the log itself
    has shown goes before the rig's.
    """
    rows = rows.copy()
    if blocks.stop is not None:
        rows[:, COLUMN["stroke"]] = 2.0 * blocks.stop
        return rows
    half = 0.5 * rows[:, COLUMN["stroke"]]
    shown = np.abs(blocks.reach - half) <= AT_STOP * half
    rows[:, COLUMN["stroke"]] = np.where(shown, 2.0 * half, longest_stroke(circuit_values(rows)))
    return rows


def _outputs(blocks: Blocks, states: Array, rows: Array) -> Array:
    """Return what is compared, of states, shape (samples, states, m), and rows, shape (1 or samples, m, parameters)."""
    velocity = np.diff(states[:: blocks.block, 2], axis=0) / (blocks.block * blocks.sample_time)
    if blocks.pressure is None:
        return np.ascontiguousarray(velocity.T)[..., None]
    whose = circuit_plant(rows.shape[-1]).parameter_class
    pressure = block_means(CIRCUIT.observe, PRESSURE, states[:-1], rows, blocks.block, whose)
    return np.stack([velocity.T, pressure.T], axis=-1)
