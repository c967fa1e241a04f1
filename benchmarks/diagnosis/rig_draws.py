"""Random realistic rigs: actuators of various sizes, oils, motors, sensors and loads, and the logs of their benches.

Sizes cover the range in which such actuators are built, and related quantities are drawn together: the pump with piston
and velocity, the oil with the stroke, leakage with the pump's flow, friction with pressure, sensors with their ranges.
A rig that nobody would build or run is drawn again (see `_drive` and `is_sound`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from types import MappingProxyType

import numpy as np

from benchmarks.diagnosis.population import draw_parameters
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS
from plant.arrays import Array
from plant.eha.circuit_parameters import CircuitParameters, oil_demand
from plant.eha.doubts import DEFAULT_UNCERTAINTIES
from plant.eha.drives import STEPS, chirp, multisine, nine_steps, prbs, sine
from plant.eha.model import PARAMETER_NAMES, EhaParameters, load_on_rod
from plant.eha.scales import natural_frequency
from plant.eha.simulate import CIRCUIT, simulate
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import Sensors

DRIVES = ("steps", "sine", "chirp", "prbs", "multisine")

SAMPLE_TIMES = (2e-4, 5e-4, 1e-3, 2e-3)
"""Sample times that loggers offer [s]; a draw is limited to those that give at least six samples in each period of the
resonance."""

MOST_SAMPLES = 30_000
"""Maximum samples of a log: a fast logger records for a shorter time."""

SPREAD = 0.1
"""Half-width of leakage, friction and presliding about their condition; bulk modulus has twice that [fraction]."""

BULK_MODULUS_SPREAD = 0.3
"""Standard deviation of the logarithm of a file's bulk modulus: air and hoses are seldom considered."""

UNCERTAIN_ENTRIES = ("pump_displacement", "piston_area", "chamber_volume", "moving_mass")
"""Entries of a wrong rig file that are off by the uncertainties of `plant.eha.doubts`, all at once."""


@dataclass(frozen=True, eq=False)
class Bench:
    """A log of a randomly drawn rig, and its truth.

    Parameters
    ----------
    condition : str
        Its true condition.
    true : CircuitParameters
        The logged actuator.
    healthy : EhaParameters
        The same actuator without fault, as the right rig file describes it.
    drive : str
        Name of the drive.
    record : Record
        What the sensors logged.
    """

    condition: str
    true: CircuitParameters
    healthy: EhaParameters
    drive: str
    record: Record

    @property
    def about(self) -> str:
        """One-line description of the rig."""
        p = self.true
        sides = "single rod" if p.area_difference else "through rod"
        loaded = " load" * bool(p.load_force) + " spring" * bool(p.load_stiffness)
        return (
            f"{self.condition}; {self.drive}, {1e3 * self.record.sample_time:g} ms, {self.record.duration:.1f} s; "
            f"{1e4 * p.piston_area:.3g} cm2, {sides}{loaded}, {1e-5 * p.relief_pressure:.3g} bar, "
            f"{1e-6 * p.bulk_modulus:.4g} MPa, {natural_frequency(p):.3g} Hz"
        )


def draw_bench(seed: int) -> Bench:
    """Return the log of one random rig.

    Parameters
    ----------
    seed : int
        Seed of every draw.
    """
    rng = stream(seed, "random rigs")
    while True:
        healthy = draw_rig(rng)
        condition = str(rng.choice(list(CONDITIONS)))
        true = draw_parameters(condition, rng, SPREAD, healthy)
        assert isinstance(true, CircuitParameters)  # noqa: S101 -- conditions change values, not the kind
        name, speed, sample_time = _drive(healthy, rng)
        if len(speed) == 0 or not is_sound(true):
            continue
        sensors = _sensors(healthy, sample_time, rng)
        try:
            record = simulate(CIRCUIT, speed, sample_time, true, sensors=sensors, rng=rng)
        except HydrostateError:  # the run left the range of the circuit model, for example with an empty accumulator
            continue
        if is_moving(record, sensors):
            kept = ("motor_speed_rad_s", "position_m", "velocity_m_s", "differential_pressure_pa")
            record = Record(sample_time, {channel: record[channel] for channel in kept})
            return Bench(condition, true, rig_file_of(healthy), name, record)


def draw_rig(rng: np.random.Generator) -> CircuitParameters:
    """Return a healthy actuator of a random size.

    Returns
    -------
    CircuitParameters
        The actuator with its circuit.

    Examples
    --------
    >>> rig = draw_rig(np.random.default_rng(0))
    >>> 3e-4 <= rig.piston_area <= 8e-3
    True
    """
    area = _log_uniform(3e-4, 8e-3, rng)  # pistons of 20 to 100 mm
    velocity = _log_uniform(0.03, 0.4, rng)  # at rated speed [m/s]; seals are rated to about 0.5
    stroke = _log_uniform(0.05, 0.5, rng)
    rated = _log_uniform(120.0, 420.0, rng)  # 1,150 to 4,000 rpm
    relief = _log_uniform(35e5, 250e5, rng)
    oil = _log_uniform(2e8, 1.4e9, rng)  # effective: hoses and air below 1 GPa, steel lines above
    volume = 0.25 * area * stroke * (1.0 + _log_uniform(0.15, 1.0, rng))  # the swept volume, plus ports and lines
    stiffness = oil * area**2 / volume
    mass = stiffness / (2.0 * pi * _log_uniform(15.0, 350.0, rng)) ** 2
    flow = area * velocity
    leak = (
        flow * _log_uniform(0.005, 0.05, rng) / relief
    )  # volumetric efficiency of 95 to 99.5 % at the relief pressure
    healthy_pressure = min(_log_uniform(1e5, 8e5, rng), 0.13 * relief)  # taken by seals and lines at rated velocity
    shares = rng.dirichlet((6.0, 3.0, 2.0))  # Coulomb, linear, quadratic
    push = area * healthy_pressure * shares
    single = bool(rng.random() < 0.3)
    uneven = float(rng.uniform(0.1, 0.3)) if single else 0.0  # rod diameters of 0.43 to 0.68 of the bore
    needed = (1.0 + uneven) * area * stroke / (3.79 * volume) - 1.0  # else the larger side has no room for the stroke
    loaded, sprung = rng.random() < 0.3, rng.random() < 0.15
    most = area * relief
    made = CircuitParameters(
        pump_displacement=flow / rated,
        piston_area=area,
        chamber_volume=volume,
        moving_mass=mass,
        bulk_modulus=oil,
        leakage_coefficient=leak,
        flow_bias=flow * _log_uniform(0.002, 0.04, rng),
        friction_coulomb=float(push[0]),
        friction_linear=float(push[1]) / velocity,
        friction_quadratic=float(push[2]) / velocity**2,
        relief_pressure=relief,
        relief_conductance=flow / (_log_uniform(0.005, 0.05, rng) * relief),
        accumulator_pressure=_log_uniform(2e5, 15e5, rng),
        makeup_conductance=flow / _log_uniform(0.3e5, 2e5, rng),
        makeup_opening=_log_uniform(3e3, 3e4, rng),
        motor_speed_per_volt=0.25 * rated,
        motor_speed_limit=2.0 * rated,
        stroke=stroke,
        area_difference=uneven,
        volume_difference=max(uneven * float(rng.uniform(0.5, 1.0)), uneven and needed),
        pilot_share=float(rng.uniform(0.5, 2.0)) if single and rng.random() < 0.5 else 0.0,
        load_force=float(rng.choice((-1.0, 1.0))) * _log_uniform(0.03, 0.2, rng) * most if loaded else 0.0,
        load_stiffness=_log_uniform(0.05, 0.15, rng) * most / (0.5 * stroke) if sprung else 0.0,
        pump_crossport_leakage=float(rng.uniform(0.2, 0.6)) * leak,
        pump_case_leakage=float(rng.uniform(0.0, 0.1)) * leak,
        motor_lag=_log_uniform(3e-3, 2e-2, rng),  # servo drives of 8 to 50 Hz
        presliding_displacement=_log_uniform(5e-6, 5e-5, rng),
        presliding_damping=_log_uniform(0.1, 0.4, rng),
        throttle_rated_flow=20.0 * flow,
        end_stop_stiffness=10.0 * stiffness,
        accumulator_gas=1.0,
        accumulator_oil=1.0,
    )
    taken = 2.0 * oil_demand(made) + 4.0 * area * uneven * stroke  # for compression, and for the rod's own volume
    return replace(made, accumulator_gas=taken, accumulator_oil=taken)


def rig_file_of(rig: EhaParameters) -> EhaParameters:
    """Return the content of an actuator's rig file: of its circuit, only the gas volume of the accumulator."""
    return EhaParameters(**{name: getattr(rig, name) for name in PARAMETER_NAMES})


def wrong_rig_file(right: EhaParameters, seed: int) -> EhaParameters:
    """Return a rig file whose entries have the usual errors, all at once.

    Parameters
    ----------
    right : EhaParameters
        The correct entries.
    seed : int
        Seed of the errors.
    """
    rng = stream(seed, "random rigs", "file")
    spreads: Mapping[str, float] = MappingProxyType(
        {name: DEFAULT_UNCERTAINTIES[name].usual.down for name in UNCERTAIN_ENTRIES}
    )
    off = {**spreads, "bulk_modulus": BULK_MODULUS_SPREAD}
    return replace(right, **{name: getattr(right, name) * float(np.exp(s * rng.normal())) for name, s in off.items()})


def _log_uniform(least: float, most: float, rng: np.random.Generator) -> float:
    """Return a log-uniform number: sizes of machines vary by ratios."""
    return float(least * (most / least) ** rng.random())


def is_sound(p: CircuitParameters) -> bool:
    """Return whether the actuator withstands its own moves: an instant stop takes at most half its pressure."""
    velocity = p.pump_displacement * p.rated_speed / p.piston_area
    ringing = velocity * p.moving_mass * 2.0 * pi * natural_frequency(p)
    held = abs(load_on_rod(0.5 * (p.stroke or 0.0), p))
    return ringing < 0.5 * p.piston_area * p.relief_pressure and held < 0.4 * p.piston_area * p.relief_pressure


def _drive(p: CircuitParameters, rng: np.random.Generator) -> tuple[str, Array, float]:
    """Return a drive's name, motor speed [rad/s] and sample time [s]; no samples if the stroke is too short.

    The pumped piston travel stays within 90 % of the stroke.
    """
    frequency, velocity, stroke = natural_frequency(p), p.pump_displacement * p.rated_speed / p.piston_area, p.stroke
    assert stroke is not None  # noqa: S101 -- every rig that is drawn has one
    slowest = 1.0 / (6.0 * frequency)
    sample_time = float(rng.choice([some for some in SAMPLE_TIMES if some <= max(slowest, SAMPLE_TIMES[0])]))
    duration = min(float(rng.uniform(4.0, 12.0)), MOST_SAMPLES * sample_time)
    name = str(rng.choice(DRIVES))
    amplitude = float(rng.uniform(0.5, 1.0)) * p.rated_speed
    highest = min(30.0, 0.5 * frequency)
    if name == "steps":
        held = min(duration / STEPS, 0.45 * stroke / velocity)
        speed = nine_steps(STEPS * held, sample_time, p, rng) if held > 0.12 else np.empty(0)
        return name, speed, sample_time
    if name == "sine":
        least = velocity / (pi * 0.45 * stroke)
        often = _log_uniform(least, max(least, min(10.0, 0.5 * frequency)), rng)
        speed = sine(duration, sample_time, amplitude, often)
    elif name == "chirp":
        speed = chirp(duration, sample_time, amplitude, 0.5, highest)
    elif name == "prbs":
        speed = prbs(duration, sample_time, amplitude, _log_uniform(0.02, 0.2, rng), rng)
    else:
        speed = multisine(duration, sample_time, amplitude, rng, 0.5, highest)
    way = np.cumsum(speed) * sample_time * p.pump_displacement / p.piston_area
    room = 0.45 * stroke / float(np.max(np.abs(way)))
    return name, (min(1.0, room) * speed if room > 0.3 else np.empty(0)), sample_time


def _sensors(p: CircuitParameters, sample_time: float, rng: np.random.Generator) -> Sensors:
    """Return sensors with the ranges that the rig needs."""
    velocity = p.pump_displacement * p.rated_speed / p.piston_area
    quantum = _log_uniform(5e-7, 5e-6, rng)  # linear encoders of 0.5 to 5 um
    return Sensors(
        speed_noise=_log_uniform(2e-4, 1e-3, rng) * p.rated_speed,
        velocity_noise=_log_uniform(2e-3, 2e-2, rng) * velocity,
        pressure_noise=_log_uniform(3e-4, 2e-3, rng) * p.relief_pressure,  # for transmitters of that range
        pressure_quantum=2.0**-14 * p.relief_pressure,
        position_noise=float(rng.uniform(0.0, 1.0)) * quantum,
        position_quantum=quantum,
        velocity_window=max(5e-3, 2.0 * sample_time),
        velocity_from_position=bool(rng.random() < 0.5),
    )


def is_moving(record: Record, sensors: Sensors) -> bool:
    """Return whether the piston travels more than 100 encoder steps."""
    return float(np.ptp(record["position_m"])) > 100.0 * sensors.position_quantum
