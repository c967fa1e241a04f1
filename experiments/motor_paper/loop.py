"""The loop of the diaphragm-motor paper's section 5 on its linear model: relay, P, PI and PID with delay and noise.

The displacement x_2 follows a step. The paper gives no gains; ours come from the model (`designed_controllers`), and
the relay test finds the point of oscillation without the model.
"""

from collections.abc import Mapping
from math import pi

import numpy as np
import pandas as pd

from experiments.page.frames import Frames, Rows, as_stacked_table, as_table
from experiments.running.random_streams import stream
from plant.motor_paper.loop_blocks import (
    LoopRun,
    Pid,
    PidMemory,
    band_limited_noise,
    pid_step,
    relay,
    run_loop,
    ultimate_point,
)
from plant.motor_paper.vibration_model import VibrationParameters, massless_matrices, reduced_stiffness

SAMPLE_TIME, DELAY = 1e-5, 5
"""Sample time of the loop [s], and delay of its command [samples]."""

STEP, DURATION = 2e-5, 0.06
"""The reference [m] from 2 ms on, and the duration of the runs [s]."""

NOISE_DENSITY = 1e-18
"""Noise density of the displacement measurement [m^2/Hz]: 0.3 um at 10 us."""

SAFETY = 2.5
"""Gain margin of the integral action at the resonance [dimensionless]."""

PROPORTIONAL = 0.1
"""Proportional gain times the gain at rest; with a larger one the resonance oscillates because of the delay
[dimensionless]."""

WANTED_DAMPING = 0.5
"""Damping ratio that the derivative action sets [dimensionless]."""


def _gain_at_rest(p: VibrationParameters) -> float:
    """Return the steady displacement per newton, by the corrected equation 4 [m/N] (errata M4)."""
    k1, k2 = p.diaphragm_stiffness, p.fluid_stiffness
    return k2 / (k1 + k2) / reduced_stiffness(p)


def designed_controllers(p: VibrationParameters) -> Mapping[str, Pid]:
    """Return a P, a PI and a PID controller for the model, section 5.1.1.

    Integral action alone would oscillate at ``2 zeta omega_n`` over the gain at rest; `SAFETY` keeps it below this. The
    derivative action raises zeta, and with it the permitted integral gain.

    Returns
    -------
    Mapping[str, Pid]
        Controllers by name; gains in N/m, N/(m s), N s/m.
    """
    omega = 2.0 * pi * p.natural_frequency
    zeta = p.damping / (2.0 * p.cylinder_mass * omega)
    at_rest = _gain_at_rest(p)
    share = p.fluid_stiffness / (p.diaphragm_stiffness + p.fluid_stiffness)
    derivative = 2.0 * (WANTED_DAMPING - zeta) * omega * p.cylinder_mass / share
    gain, integral = PROPORTIONAL / at_rest, 2.0 * WANTED_DAMPING * omega / at_rest / SAFETY
    return {
        "P": Pid(gain),
        "PI": Pid(gain, 2.0 * zeta * omega / at_rest / SAFETY),
        "PID": Pid(gain, integral, derivative, 3.0 * SAMPLE_TIME),
    }


@as_stacked_table
def loop_runs(p: VibrationParameters, seed: int) -> Frames:
    """Return the step response under each controller, with delay and noise.

    Returns
    -------
    pandas.DataFrame
        Columns controller, time_s, reference_m, output_m, command_n.
    """
    count = round(DURATION / SAMPLE_TIME) + 1
    reference = np.where(np.arange(count) * SAMPLE_TIME >= 2e-3, STEP, 0.0)
    noise = band_limited_noise(stream(seed, "loop"), count, SAMPLE_TIME, NOISE_DENSITY)
    for name, pid in designed_controllers(p).items():
        run = _run_under_pid(p, pid, reference, noise)
        columns = {"time_s": run.time, "reference_m": reference, "output_m": run.output, "command_n": run.command}
        yield {"controller": name, **columns}


def _run_under_pid(p: VibrationParameters, pid: Pid, reference: np.ndarray, noise: np.ndarray) -> LoopRun:
    def controller(memory: PidMemory, error: float) -> tuple[float, PidMemory]:
        return pid_step(pid, memory, error, SAMPLE_TIME)

    return run_loop(massless_matrices(p), controller, PidMemory(), reference, SAMPLE_TIME, delay=DELAY, noise=noise)


@as_table
def loop_table(runs: pd.DataFrame) -> Rows:
    """Return the characteristics of the step response for each controller.

    Parameters
    ----------
    runs : pandas.DataFrame
        Table from `loop_runs`.

    Returns
    -------
    pandas.DataFrame
        Columns controller, overshoot_percent (of the final value), settling_time_s (until it stays within 5 % of that),
        error_percent (of the step, over the last quarter), ripple_m (standard deviation there).
    """
    for name, run in runs.groupby("controller", sort=False):
        after = run[run["reference_m"] > 0.0]
        time, output = (after[column].to_numpy() for column in ("time_s", "output_m"))
        end = output[3 * len(output) // 4 :]
        settled = float(end.mean())
        outside = np.flatnonzero(np.abs(output / settled - 1.0) > 0.05)
        yield {
            "controller": name,
            "overshoot_percent": 100.0 * (float(output.max()) / settled - 1.0),
            "settling_time_s": float(time[outside[-1]] - time[0]),
            "error_percent": 100.0 * (1.0 - settled / STEP),
            "ripple_m": float(end.std()),
        }


def relay_table(p: VibrationParameters) -> pd.DataFrame:
    """Return the results of a relay test, beside the model's own values.

    Returns
    -------
    pandas.DataFrame
        Columns quantity, relay, model, unit.
    """
    push = STEP / _gain_at_rest(p)

    def controller(high: bool, error: float) -> tuple[float, bool]:
        now = relay(high, error)
        return (push if now else -push), now

    rest = np.zeros(round(DURATION / SAMPLE_TIME) + 1)
    run = run_loop(massless_matrices(p), controller, True, rest, SAMPLE_TIME, delay=DELAY)
    gain, frequency = ultimate_point(run, push)
    model_gain, model_frequency = _phase_crossover(p)
    rows = [("ultimate frequency", frequency, model_frequency, "Hz"), ("ultimate gain", gain, model_gain, "N/m")]
    return pd.DataFrame(rows, columns=["quantity", "relay", "model", "unit"])


def _phase_crossover(p: VibrationParameters) -> tuple[float, float]:
    """Gain and frequency at which model, delay and hold together have a phase lag of 180 degrees."""
    omega = 2.0 * pi * np.linspace(0.5, 3.0, 100001) * p.natural_frequency
    s = 1j * omega
    A, B, C, _ = massless_matrices(p)
    model = B[1, 0] * C[0, 0] / (s * s - A[1, 1] * s - A[1, 0])
    late = np.exp(-s * DELAY * SAMPLE_TIME) * (1.0 - np.exp(-s * SAMPLE_TIME)) / (s * SAMPLE_TIME)
    response = model * late
    where = int(np.argmin(np.abs(np.angle(-response))))
    return float(1.0 / abs(response[where])), float(omega[where] / (2.0 * pi))


@as_stacked_table
def spectrum_table(runs: pd.DataFrame) -> Frames:
    """Return the amplitude spectra that noise gives the commands at constant reference, Figures 19 and 20.

    Parameters
    ----------
    runs : pandas.DataFrame
        Table from `loop_runs`.

    Returns
    -------
    pandas.DataFrame
        Columns controller, frequency_hz (up to 5 kHz) and amplitude_n, of the second half of the command without its
        mean, Hann window.
    """
    for name, run in runs.groupby("controller", sort=False):
        command = run["command_n"].to_numpy()[len(run) // 2 :]
        window = np.hanning(len(command))
        lines = 2.0 * np.abs(np.fft.rfft((command - command.mean()) * window)) / window.sum()
        frequency = np.fft.rfftfreq(len(command), SAMPLE_TIME)
        kept = (frequency > 0.0) & (frequency <= 5e3)
        yield {"controller": name, "frequency_hz": frequency[kept], "amplitude_n": lines[kept]}
