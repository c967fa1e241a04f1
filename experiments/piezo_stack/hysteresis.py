"""Bouc-Wen parameters of a simulated stack: the paper's procedure as printed, and ours (errata P14)."""

from dataclasses import replace

import numpy as np

from estimation.piezo_stack.bouc_wen import LOOP, fit_stack_loop, loop_bounds
from estimation.piezo_stack.bouc_wen_printed import printed_fit
from experiments.page.frames import Rows, as_table
from experiments.running.random_streams import stream
from plant.piezo_stack.free import run_free_stack
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import SAMPLE_TIME, sine_drive

SLOW_FREQUENCY = 0.1
"""Frequency at which the stack's lag changes its displacement by only a nanometre [Hz]."""

SAMPLES = round(1.0 / (SLOW_FREQUENCY * SAMPLE_TIME))
"""Samples in a cycle, as the bench logs them."""

FEW_SAMPLES = 5000
"""Samples in a cycle of a slow logger."""

CYCLES = 3
"""Number of cycles from rest until a loop has closed; the last one is logged."""

NOISE = 2e-8
"""Noise of the displacement sensor [m]."""

SMALL, LARGE = 5.0, 100.0
"""Peak-to-peak voltages of the small and of the large experiment [V]."""


@as_table
def hysteresis_table(p: PiezoStackParameters, seed: int) -> Rows:
    """Return the results of the printed procedure and of the fit for one closed loop of 100 V.

    Parameters
    ----------
    seed : int
        Seed of the sensor noise; the printed procedure gets noise-free signals, because noise makes it fail earlier.

    Returns
    -------
    pandas.DataFrame
        Columns parameter, truth, printed, fitted, low, high, error_percent, covered.
    """
    voltage, displacement = slow_loop(p, LARGE)
    noisy = displacement + NOISE * stream(seed, "stack loop").standard_normal(len(displacement))
    fit = fit_stack_loop(voltage, noisy, from_rest=False)
    small = slow_loop(p, SMALL)
    settled = run_free_stack(p, np.append(0.0, np.full(400, SMALL)), 1e-5)[-1]
    printed = printed_fit((SMALL, float(settled)), small, (voltage, displacement))
    for name in LOOP:
        truth, (low, high) = float(getattr(p, name)), fit.interval(name)
        yield {
            "parameter": name,
            "truth": truth,
            "printed": printed.values[name],
            "fitted": fit.values[name],
            "low": low,
            "high": high,
            "error_percent": 100.0 * (fit.values[name] / truth - 1.0),
            "covered": low <= truth <= high,
        }


@as_table
def loop_card(p: PiezoStackParameters) -> Rows:
    """Return the Cramér-Rao bounds for a slow loop of 100 V, by its waveform and sample rate.

    Returns
    -------
    pandas.DataFrame
        Columns loop, samples, and for each parameter its standard deviation in percent; infinite if the loop does not
        determine it.
    """
    for samples in (FEW_SAMPLES, SAMPLES):
        for loop, cycles, from_rest in (
            ("one loop that begins at rest", 1, True),
            ("one closed loop", 1, False),
            ("three loops that begin at rest", CYCLES, True),
        ):
            voltage = 0.5 * LARGE * (1.0 - np.cos(2.0 * np.pi * np.arange(cycles * samples + 1) / samples))
            bounds = loop_bounds(p, voltage, NOISE, from_rest=from_rest)
            yield {"loop": loop, "samples": samples, **{name: 100.0 * bound for name, bound in bounds.items()}}


def slow_loop(p: PiezoStackParameters, swing: float) -> tuple[np.ndarray, np.ndarray]:
    """Return voltage and displacement of one slow cycle, after the stack has been cycled until its loop closed.

    Parameters
    ----------
    p : PiezoStackParameters
        The stack; its own vibration is damped, which has no visible effect at this frequency.
    swing : float
        Peak-to-peak voltage of the drive [V].

    Returns
    -------
    tuple of ndarray, shape (n,)
        Voltage [V], displacement [m].
    """
    voltage = sine_drive(SLOW_FREQUENCY, swing, CYCLES / SLOW_FREQUENCY, SAMPLE_TIME)
    heavy = replace(p, stack_mass=100.0 * p.stack_mass, stack_damping=10.0 * p.stack_damping)
    displacement = run_free_stack(heavy, voltage, SAMPLE_TIME)
    return voltage[-SAMPLES - 1 :], displacement[-SAMPLES - 1 :]
