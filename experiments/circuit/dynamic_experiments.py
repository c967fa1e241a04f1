"""The paper's dynamic experiments on the circuit plant: Figures 5 to 7, 10 and 11, as tables.

A test around a mean is a train of passes, see `experiments.circuit.passes`, each over up to 0.6 of the stroke. Without
a mean the signal itself returns the piston, see `plant.eha.drives.prbs`.
"""

from collections.abc import Iterable, Sequence
from dataclasses import fields
from itertools import product
from math import ceil

import numpy as np
import pandas as pd

from estimation.eha.bulk_modulus import estimate_bulk_modulus
from experiments.circuit.passes import CHANNELS, SAMPLE_TIME, Passes, in_condition, run_passes
from experiments.nine_conditions.bulk_modulus import Experiment, estimate_entries
from experiments.nine_conditions.settings import StudySettings
from experiments.nine_conditions.transfer_functions import measured_response, order_table
from experiments.running.executors import map_in_parallel
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.log.record import Record

AMPLITUDE_V = 1.0
"""Amplitude around the means [V]."""

MEAN_INPUTS = tuple((float(mean), AMPLITUDE_V) for mean in range(8))
"""Means and amplitudes of Figure 5 [V]; the last swings to 8 V, the motor's limit."""

AMPLITUDE_INPUTS = tuple((0.0, amplitude) for amplitude in (0.5, 1.0, 2.0, 3.0, 4.0))
"""Means and amplitudes of Figure 6 [V]."""

HOLD_TIME = 0.02
"""Time between possible switches [s]; the signal has no power at 50 Hz."""

LOWEST_FREQUENCY, HIGHEST_FREQUENCY = 1e-9, 40.0
"""Ends of the response curves [Hz]: they exclude the mean and the frequencies at which the signal has no power."""

TEST_TIME = 24.0
"""Minimum total duration of all passes of a test [s]."""

LAG_TIME = 0.5
"""Longest lag of the correlations used to compute the responses [s]."""

CIRCUIT_FORMS = (
    Experiment("circuit", "flow", "steps", True),
    Experiment("circuit", "pressure", "steps", True),
    Experiment("circuit", "acceleration", "sine", False),
)
"""The forms that estimate bulk modulus on the circuit: the flow balance alone, condition unknown; the pressure form,
condition known; the published method (errata E9, E13)."""

ESTIMATE_COLUMNS = (
    *("form", "drive", "pressure_logged", "condition", "start_pa", "outcome", "value_pa", "ci95_low_pa"),
    *("ci95_high_pa", "truth_pa", "error_percent", "covered", "bound_percent", "gate_passed", "reasons"),
)

_LONGEST_PASS = 4.0
_SETTLING = 0.3
_STROKE_SHARE = 0.6


def prbs_around(
    p: CircuitParameters, mean_v: float, amplitude_v: float, rng: np.random.Generator, duration: float = TEST_TIME
) -> Record:
    """Return a random binary test around an input mean, as motor speed and velocity about their means.

    Parameters
    ----------
    mean_v, amplitude_v : float
        Mean, not negative, and amplitude of the input [V].
    duration : float
        Minimum total duration of all passes [s].

    Returns
    -------
    Record
        ``motor_speed_rad_s`` and ``velocity_m_s``, with the passes concatenated.

    Raises
    ------
    DriveError
        If the motor's limit or the stroke would be exceeded.
    """
    swept = p.pump_displacement / p.piston_area * mean_v * p.motor_speed_per_volt
    longest = min(_LONGEST_PASS, _STROKE_SHARE * p.stroke / swept) if swept > 0.0 else _LONGEST_PASS
    pass_time = SAMPLE_TIME * round(HOLD_TIME / SAMPLE_TIME) * int(longest / HOLD_TIME)
    test = Passes(mean_v, amplitude_v, ceil(duration / pass_time), pass_time, HOLD_TIME, _SETTLING)
    found = run_passes(p, test, rng)
    return Record(SAMPLE_TIME, {channel: rows.ravel() for channel, rows in zip(CHANNELS, found, strict=True)})


def frequency_responses(
    rig: CircuitParameters, seed: int, inputs: Iterable[tuple[float, float]], condition: str = "normal"
) -> pd.DataFrame:
    """Return empirical frequency responses to random binary tests of several means and amplitudes: Figures 5 and 6.

    Parameters
    ----------
    inputs : iterable of tuple of float
        Mean and amplitude of each input [V], such as `MEAN_INPUTS` and `AMPLITUDE_INPUTS`.

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
        found = measured_response(test, round(LAG_TIME / SAMPLE_TIME), LOWEST_FREQUENCY, HIGHEST_FREQUENCY)
        return pd.DataFrame({"mean_v": mean, "amplitude_v": amplitude, **found})

    return pd.concat(map_in_parallel(respond, inputs), ignore_index=True)


def low_frequency_gains(responses: pd.DataFrame, by: str) -> pd.Series:
    """Return the gain at the lowest frequency of each response.

    Parameters
    ----------
    responses : pandas.DataFrame
        Table from `frequency_responses`.
    by : str
        ``mean_v`` or ``amplitude_v``.

    Returns
    -------
    pandas.Series
        Gains [m/s per rad/s], by that voltage.
    """
    return responses.groupby(by)["gain"].first()


def order_study(rig: CircuitParameters, seed: int) -> pd.DataFrame:
    """Return the singular values of the circuit's normal condition with their noise floor: Figure 7.

    The mean is 2 V, at which the piston moves and so does not stick. From 4 V on, quadratic friction damps so much that
    only one singular value is above the floor.

    Returns
    -------
    pandas.DataFrame
        Table like that of `experiments.nine_conditions.transfer_functions.order_table`.
    """
    rng = stream(seed, "circuit order")
    return order_table(prbs_around(rig, 2.0, AMPLITUDE_V, rng), rng)


def validation_input(rig: CircuitParameters, settings: StudySettings) -> pd.DataFrame:
    """Return only the drive of section 6's nine steps: Figure 10."""
    T = settings.classification_sample_time
    speed = make_drive("steps", settings.duration, T, rig, stream(settings.seed, "circuit validation"))
    volts = speed / rig.motor_speed_per_volt
    return pd.DataFrame({"time_s": T * np.arange(len(speed)), "motor_voltage_v": volts, "motor_speed_rad_s": speed})


def bulk_modulus_on_circuit(
    rig: CircuitParameters, settings: StudySettings, conditions: Sequence[str] = tuple(CONDITIONS)
) -> pd.DataFrame:
    """Estimate bulk modulus on the circuit by three forms, in nine conditions, from every first guess: Figure 11.

    The forms assume the lumped actuator. The flow form models chambers and make-up itself and finds the true value; the
    pressure form, which assumes constant chamber volumes, reads a few percent low.

    Parameters
    ----------
    rig : CircuitParameters
        The healthy circuit; its `bulk_modulus` is the truth.

    Returns
    -------
    pandas.DataFrame
        One row for each estimate: outcome, value, interval, error, whether the interval covers the truth, gate.
    """
    truth = rig.bulk_modulus

    def estimate(case: tuple[Experiment, str]) -> list[dict[str, object]]:
        experiment, name = case
        p = in_condition(rig, name)
        record = experiment.record(p, settings, stream(settings.seed, "circuit bulk modulus", experiment.drive, name))
        known = _lumped_actuator(rig if experiment.form == "flow" else p)
        head = {**experiment._asdict(), "condition": name}
        finds = (
            (
                start,
                estimate_bulk_modulus(record, known, form=experiment.form, method=experiment.method, start=start),
            )
            for start in settings.starts
        )
        return [{**head, "start_pa": start, **estimate_entries(found, truth)} for start, found in finds]

    rows = [row for rows in map_in_parallel(estimate, product(CIRCUIT_FORMS, conditions)) for row in rows]
    frame = pd.DataFrame(rows).assign(truth_pa=truth)
    covered = (frame["ci95_low_pa"].astype(float) <= truth) & (truth <= frame["ci95_high_pa"].astype(float))
    return frame.assign(covered=covered)[list(ESTIMATE_COLUMNS)]


def _lumped_actuator(p: CircuitParameters) -> EhaParameters:
    """Return the lumped actuator that the forms use for the circuit."""
    return EhaParameters(**{field.name: getattr(p, field.name) for field in fields(EhaParameters)})
