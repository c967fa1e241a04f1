"""The paper's dynamic experiments on the circuit plant: Figures 5 to 7, 10 and 11, as tables.

Around a mean the piston runs out of stroke, so a test is a train of passes: after a lead-in that carries the piston
towards one end, every pass covers up to 0.6 of the stroke, and the mean turns round from pass to pass. What follows a
turn is left out, passes backward are counted with the other sign, and each pass has its own mean removed. Without a
mean the signal itself comes back, see `plant.signals.prbs`.
"""

from collections.abc import Iterable, Sequence
from dataclasses import fields
from itertools import product
from math import ceil

import numpy as np
import pandas as pd

from estimation.bulk_modulus import estimate_bulk_modulus
from estimation.identification.etfe import etfe
from experiments.executors import side_by_side
from experiments.streams import stream
from experiments.studies.bulk_modulus import Experiment
from experiments.studies.settings import StudySettings
from experiments.studies.transfer_functions import order_table
from faults.conditions import CONDITIONS, find_condition, parameters_for
from plant.circuit_parameters import CircuitParameters, circuit_of
from plant.drive_limits import check_drive
from plant.eha import EhaParameters
from plant.record import Record
from plant.sensors import BENCH
from plant.signals import make_drive, prbs
from plant.simulate import CIRCUIT, simulate

AMPLITUDE_V = 1.0
"""Amplitude around the means [V]."""

MEAN_INPUTS = tuple((float(mean), AMPLITUDE_V) for mean in range(8))
"""Means and amplitudes of Figure 5 [V]; the last swings to 8 V, the motor's limit."""

AMPLITUDE_INPUTS = tuple((0.0, amplitude) for amplitude in (0.5, 1.0, 2.0, 3.0, 4.0))
"""Means and amplitudes of Figure 6 [V]."""

HOLD_TIME = 0.02
"""Time between chances to switch [s]; the signal has no power at 50 Hz."""

HIGHEST_FREQUENCY = 40.0
"""End of the response curves [Hz], below where the signal has no power."""

TEST_TIME = 24.0
"""Least length of a test [s], all passes together."""

LAG_TIME = 0.5
"""Longest lag of the correlations that responses are taken from [s]."""

CIRCUIT_FORMS = (
    Experiment("circuit", "flow", "steps", True, "The flow balance alone: condition unknown."),
    Experiment("circuit", "pressure", "steps", True, "The pressure form, condition known."),
    Experiment("circuit", "acceleration", "sine", False, "The published method (errata E9, E13)."),
)
"""The forms that estimate bulk modulus on the circuit, each on its own drive."""

_SAMPLE_TIME = 1e-3
_LONGEST_PASS = 4.0
_SETTLING = 0.3
_STROKE_SHARE = 0.6


def in_condition(rig: CircuitParameters, condition: str) -> CircuitParameters:
    """Return the circuit in one of the nine conditions.

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit.
    condition : str
        Condition name.

    Returns
    -------
    CircuitParameters
        The circuit in it.

    Examples
    --------
    >>> in_condition(CircuitParameters(), "major_leakage").flow_bias
    1.465e-05
    """
    return circuit_of(parameters_for(find_condition(condition), rig))


def prbs_around(
    p: CircuitParameters, mean_v: float, amplitude_v: float, rng: np.random.Generator, duration: float = TEST_TIME
) -> Record:
    """Return a random binary test around an input mean, as motor speed and velocity about their means.

    Parameters
    ----------
    p : CircuitParameters
        The circuit.
    mean_v, amplitude_v : float
        Mean, not negative, and amplitude of the input [V].
    rng : numpy.random.Generator
        Source of the signal and of sensor noise.
    duration : float
        Least length of all passes together [s].

    Returns
    -------
    Record
        ``motor_speed_rad_s`` and ``velocity_m_s``, the passes one after the other.

    Raises
    ------
    DriveError
        If the motor's limit or the stroke would be exceeded.
    """
    mean, amplitude = (volts * p.motor_speed_per_volt for volts in (mean_v, amplitude_v))
    swept = p.pump_displacement / p.piston_area * mean
    pass_time = min(_LONGEST_PASS, _STROKE_SHARE * p.stroke / swept) if swept > 0.0 else _LONGEST_PASS
    count = round(HOLD_TIME / _SAMPLE_TIME) * int(pass_time / HOLD_TIME)
    passes = ceil(duration / (count * _SAMPLE_TIME))
    signs = np.where((np.arange(passes) % 2 == 0) | (mean == 0.0), 1.0, -1.0)
    lead_in = np.full(count // 2, -mean)
    signals = [sign * (mean + prbs(count * _SAMPLE_TIME, _SAMPLE_TIME, amplitude, HOLD_TIME, rng)) for sign in signs]
    drive = np.concatenate([lead_in, *signals])
    check_drive(drive, _SAMPLE_TIME, p)
    record = simulate(CIRCUIT, drive, _SAMPLE_TIME, p, sensors=BENCH, rng=rng)
    kept: dict[str, np.ndarray] = {}
    for channel in ("motor_speed_rad_s", "velocity_m_s"):
        rows = record[channel][len(lead_in) :].reshape(passes, count) * signs[:, None]
        rows = rows[:, round(_SETTLING / _SAMPLE_TIME) :]
        kept[channel] = (rows - rows.mean(axis=1, keepdims=True)).ravel()
    return Record(_SAMPLE_TIME, kept)


def frequency_responses(
    rig: CircuitParameters, seed: int, inputs: Iterable[tuple[float, float]], condition: str = "normal"
) -> pd.DataFrame:
    """Return empirical frequency responses to random binary tests of several means and amplitudes: Figures 5 and 6.

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit.
    seed : int
        Seed of the signals and of sensor noise.
    inputs : iterable of tuple of float
        Mean and amplitude of each input [V], as `MEAN_INPUTS` and `AMPLITUDE_INPUTS`.
    condition : str
        Condition name.

    Returns
    -------
    pandas.DataFrame
        Columns mean_v, amplitude_v, frequency_hz, gain [m/s per rad/s], phase_deg, coherence.
    """
    p = in_condition(rig, condition)

    def respond(volts: tuple[float, float]) -> pd.DataFrame:
        mean, amplitude = volts
        rng = stream(seed, "circuit response", condition, repr(mean), repr(amplitude))
        test = prbs_around(p, mean, amplitude, rng)
        found = etfe(
            test["motor_speed_rad_s"], test["velocity_m_s"], _SAMPLE_TIME, lag_window=round(LAG_TIME / _SAMPLE_TIME)
        )
        inside = (found.frequency_hz > 0.0) & (found.frequency_hz <= HIGHEST_FREQUENCY)
        return pd.DataFrame(
            {
                "mean_v": mean,
                "amplitude_v": amplitude,
                "frequency_hz": found.frequency_hz[inside],
                "gain": np.abs(found.response[inside]),
                "phase_deg": np.degrees(np.unwrap(np.angle(found.response[inside]))),
                "coherence": found.coherence[inside],
            }
        )

    return pd.concat(side_by_side(respond, inputs), ignore_index=True)


def low_frequency_gains(responses: pd.DataFrame, by: str) -> pd.Series:
    """Return the gain at the lowest frequency of each response.

    Parameters
    ----------
    responses : pandas.DataFrame
        Of `frequency_responses`.
    by : str
        ``mean_v`` or ``amplitude_v``.

    Returns
    -------
    pandas.Series
        Gains [m/s per rad/s], by that voltage.
    """
    return responses.groupby(by)["gain"].first()


def order_study(rig: CircuitParameters, seed: int, mean_v: float = 2.0) -> pd.DataFrame:
    """Return the singular values of the circuit's normal condition with their noise floor: Figure 7.

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit.
    seed : int
        Seed of the signal, sensor noise, and the floor.
    mean_v : float
        Input mean [V]. Moving, the piston does not stick; from 4 V on, quadratic friction damps so much that one
        value alone stands above the floor.

    Returns
    -------
    pandas.DataFrame
        As `experiments.studies.transfer_functions.order_table`.
    """
    rng = stream(seed, "circuit order")
    return order_table(prbs_around(rig, mean_v, AMPLITUDE_V, rng), rng)


def validation_input(rig: CircuitParameters, settings: StudySettings) -> pd.DataFrame:
    """Return the nine steps of section 6, the drive alone: Figure 10.

    Parameters
    ----------
    rig : CircuitParameters
        The circuit, for its motor speed a volt.
    settings : StudySettings
        Length, sample time and seed.

    Returns
    -------
    pandas.DataFrame
        Columns time_s, motor_voltage_v, motor_speed_rad_s.
    """
    T = settings.classification_sample_time
    speed = make_drive("steps", settings.duration, T, rig, stream(settings.seed, "circuit validation"))
    volts = speed / rig.motor_speed_per_volt
    return pd.DataFrame({"time_s": T * np.arange(len(speed)), "motor_voltage_v": volts, "motor_speed_rad_s": speed})


def bulk_modulus_on_circuit(
    rig: CircuitParameters,
    settings: StudySettings,
    conditions: Sequence[str] = tuple(CONDITIONS),
    experiments: Sequence[Experiment] = CIRCUIT_FORMS,
) -> pd.DataFrame:
    """Estimate bulk modulus on the circuit by three forms, in nine conditions, from every first guess: Figure 11.

    The forms believe the lumped actuator. The flow form follows chambers and make-up of its own and finds the truth;
    the pressure form, whose chambers keep their volume, reads a few percent low.

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit; its `bulk_modulus` is the truth.
    settings : StudySettings
        First guesses, length, sample time and seed.
    conditions : sequence of str
        Condition names.
    experiments : sequence of Experiment
        Forms and their drives.

    Returns
    -------
    pandas.DataFrame
        One row an estimate: outcome, value, interval, error, whether the interval covers the truth, gate.
    """

    def estimate(case: tuple[Experiment, str]) -> list[dict[str, object]]:
        experiment, name = case
        p = in_condition(rig, name)
        rng = stream(settings.seed, "circuit bulk modulus", experiment.drive, name)
        drive = make_drive(experiment.drive, settings.duration, settings.sample_time, p, rng)
        record = simulate(CIRCUIT, drive, settings.sample_time, p, sensors=BENCH, rng=rng)
        if not experiment.pressure_logged:
            record = record.replace(differential_pressure_pa=None)
        known = _believed(rig if experiment.form == "flow" else p)
        return [_estimated(record, known, experiment, name, start) for start in settings.starts]

    return pd.DataFrame([row for rows in side_by_side(estimate, product(experiments, conditions)) for row in rows])


def _believed(p: CircuitParameters) -> EhaParameters:
    """Return what the forms know of the circuit: the lumped actuator."""
    return EhaParameters(**{field.name: getattr(p, field.name) for field in fields(EhaParameters)})


def _estimated(
    record: Record, known: EhaParameters, experiment: Experiment, condition: str, start: float
) -> dict[str, object]:
    truth = known.bulk_modulus
    found = estimate_bulk_modulus(record, known, form=experiment.form, start=start)
    low, high = found.interval or (float("nan"), float("nan"))
    value = float("nan") if found.value is None else found.value
    return {
        "form": experiment.form,
        "drive": experiment.drive,
        "pressure_logged": experiment.pressure_logged,
        "condition": condition,
        "start_pa": start,
        "outcome": found.outcome.value,
        "value_pa": value,
        "ci95_low_pa": low,
        "ci95_high_pa": high,
        "truth_pa": truth,
        "error_percent": 100.0 * (value / truth - 1.0),
        "covered": low <= truth <= high,
        "bound_percent": 100.0 * found.bound,
        "gate_passed": found.gate.passed,
        "reasons": "; ".join(found.gate.reasons),
    }
