"""Bouc-Wen parameters of a simulated stack: the paper's procedure as printed, and ours (errata P14)."""

from dataclasses import replace

import numpy as np
import pandas as pd

from estimation.bouc_wen import SHAPE, fit_stack_loop
from estimation.bouc_wen_printed import printed_fit
from experiments.streams import stream
from plant.piezo_stack_free import run_free_stack
from plant.piezo_stack_parameters import PiezoStackParameters
from plant.piezo_stack_run import sine_drive

SLOW = 0.1
"""Frequency at which the stack's lag moves it by a nanometre only [Hz]."""

SAMPLES = 5000
"""Samples in a cycle."""

CYCLES = 3
"""Cycles from rest: on the first the hysteresis hardly changes sign, and its four parameters are two."""

NOISE = 2e-8
"""Noise of the displacement sensor [m]."""

SMALL, LARGE = 5.0, 100.0
"""Swings of the small and of the large experiment [V]."""


def hysteresis_table(p: PiezoStackParameters, seed: int) -> pd.DataFrame:
    """Return what the printed procedure and the fit make of one 100 V loop.

    Parameters
    ----------
    p : PiezoStackParameters
        The stack that is measured.
    seed : int
        Seed of the sensor noise; the printed procedure is given noiseless signals, or it fails sooner.

    Returns
    -------
    pandas.DataFrame
        Columns parameter, truth, printed, fitted, low, high, error_percent, covered.
    """
    voltage, displacement = slow_loop(p, LARGE)
    noisy = displacement + NOISE * stream(seed, "stack loop").standard_normal(len(displacement))
    fit = fit_stack_loop(voltage, noisy)
    small = slow_loop(p, SMALL)
    settled = run_free_stack(p, np.append(0.0, np.full(400, SMALL)), 1e-5)[-1]
    last = slice(-SAMPLES - 1, None)
    printed = printed_fit(
        (SMALL, float(settled)), (small[0][last], small[1][last]), (voltage[last], displacement[last])
    )
    rows = []
    for name in ("free_stroke_a_volt", *SHAPE):
        truth, (low, high) = float(getattr(p, name)), fit.interval(name)
        rows.append(
            {
                "parameter": name,
                "truth": truth,
                "printed": printed.values[name],
                "fitted": fit.values[name],
                "low": low,
                "high": high,
                "error_percent": 100.0 * (fit.values[name] / truth - 1.0),
                "covered": low <= truth <= high,
            }
        )
    return pd.DataFrame(rows)


def slow_loop(p: PiezoStackParameters, swing: float) -> tuple[np.ndarray, np.ndarray]:
    """Return voltage and displacement of slow cycles from rest.

    Parameters
    ----------
    p : PiezoStackParameters
        The stack; its own vibration is damped, which at this frequency nobody sees.
    swing : float
        Swing of the drive [V].

    Returns
    -------
    tuple of ndarray, shape (n,)
        Voltage [V], displacement [m].
    """
    sample_time = 1.0 / (SLOW * SAMPLES)
    voltage = sine_drive(SLOW, swing, CYCLES / SLOW, sample_time)
    heavy = replace(p, stack_mass=100.0 * p.stack_mass, stack_damping=10.0 * p.stack_damping)
    return voltage, run_free_stack(heavy, voltage, sample_time)
