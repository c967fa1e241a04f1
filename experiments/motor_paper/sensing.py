"""Velocity of the diaphragm motor from its sensing voltages, by multiple linear regression on simulated data.

The paper sets out to do this, but its Figure 12 does not (errata M19, M24). The data are voltages of the middle
electrodes over drive voltages and loads, at 480 Hz. The module also gives the spectra of the driven motor, Figure 21.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import ceil

import numpy as np
import pandas as pd

from experiments.motor_paper.regression import fit, inflations, predictive_r_square
from experiments.page.frames import Frames, Rows, as_stacked_table, as_table
from experiments.running.random_streams import stream
from plant.diaphragm_motor.flow import SETTLING_TIME, operate
from plant.diaphragm_motor.model import FLOWS, VELOCITY, deflections
from plant.diaphragm_motor.parameters import DIAPHRAGMS, DiaphragmMotorParameters, with_changed_value
from plant.diaphragm_motor.run import ELECTRODES, LONGEST_STEP, motor_drive, run_motor
from plant.motor_paper.hysteresis_model import harmonics, total_harmonic_distortion

FREQUENCY = 480.0
"""Frequency of the drive, section 7.1 [Hz]."""

SWINGS, LOAD_SHARES = (100.0, 150.0, 200.0, 250.0, 300.0), (0.0, 0.03, 0.06, 0.09, 0.12, 0.15)
"""Peak-to-peak drive voltages [V], and ratios of load [N] to that voltage: thirty points up to nearly the blocking
force."""

RELATIVE_NOISE = 0.005
"""Noise relative to an electrode's amplitude [dimensionless]."""

DRIVE = "peak_to_peak_v"

MODELS: Mapping[str, Sequence[str]] = {
    "A4": (ELECTRODES[3],),
    "A3, A4, A5, as the paper wants": ELECTRODES[2:5],
    "all seven": ELECTRODES,
    "A4 and drive voltage": (ELECTRODES[3], DRIVE),
    "A3, A4, A5 and drive voltage": (*ELECTRODES[2:5], DRIVE),
}
"""Regressors of velocity, by the name of the model."""

FAULTS = {
    "A4 reads 20 % low": ("sensor_gain", 4, 0.8),
    "A4 lost 20 % of its polarisation": ("polarisation", 4, 0.8),
    "valve 4 stuck open": ("valve_leak", 4, 1.0),
    "gas of 2 % in chamber 4": ("gas_fraction", 4, 0.02),
}
"""Faults of one part: parameter, place, value."""

HARMONICS = 9
"""Highest reported multiple of the drive's frequency [dimensionless]."""


@as_table
def operating_points(p: DiaphragmMotorParameters, seed: int) -> Rows:
    """Return velocity and electrodes' amplitudes at thirty drives and loads, with noise.

    Returns
    -------
    pandas.DataFrame
        Columns peak_to_peak_v, load_n, velocity_m_s and one for each electrode [V].
    """
    rng = stream(seed, "motor sensing")
    for swing, share in product(SWINGS, LOAD_SHARES):
        yield _operating_point(replace(p, load_force=share * swing), swing, rng)


def _operating_point(p: DiaphragmMotorParameters, swing: float, rng: np.random.Generator) -> dict[str, float]:
    point = operate(p, FREQUENCY, swing)
    read = np.abs(point.tones) * (1.0 + RELATIVE_NOISE * rng.standard_normal(DIAPHRAGMS))
    amplitudes = dict(zip(ELECTRODES, read.tolist(), strict=True))
    return {DRIVE: swing, "load_n": p.load_force, "velocity_m_s": point.velocity, **amplitudes}


@as_stacked_table
def sensing_predictions(points: pd.DataFrame) -> Frames:
    """Return the velocity that each regression gives for the points that it was fitted to.

    Parameters
    ----------
    points : pandas.DataFrame
        Table from `operating_points`.

    Returns
    -------
    pandas.DataFrame
        Columns regressors, peak_to_peak_v, velocity_m_s and fitted_m_s.
    """
    for words, names in MODELS.items():
        fitted = fit(points, names, "velocity_m_s").fittedvalues
        yield points[[DRIVE, "velocity_m_s"]].assign(regressors=words, fitted_m_s=fitted)


@as_table
def sensing_regressions(points: pd.DataFrame) -> Rows:
    """Return the regressions of velocity on each set of sensing voltages.

    Parameters
    ----------
    points : pandas.DataFrame
        Table from `operating_points`.

    Returns
    -------
    pandas.DataFrame
        Columns regressors, r_square, predictive_r_square, error_m_s (standard error), largest_vif, and smallest and
        largest_coefficient of the electrodes [m/s per volt].
    """
    for words, names in MODELS.items():
        found = fit(points, names, "velocity_m_s")
        electrodes = found.params[[name for name in names if name != DRIVE]]
        yield {
            "regressors": words,
            "r_square": float(found.rsquared),
            "predictive_r_square": predictive_r_square(found),
            "error_m_s": float(np.sqrt(found.mse_resid)),
            "largest_vif": max(inflations(found)),
            "smallest_coefficient": float(electrodes.min()),
            "largest_coefficient": float(electrodes.max()),
        }


@as_table
def sensing_faults(p: DiaphragmMotorParameters, points: pd.DataFrame) -> Rows:
    """Return the predictions of each healthy regression for a faulty motor at 200 V and 10 N, without noise.

    Parameters
    ----------
    points : pandas.DataFrame
        Table from `operating_points` for the healthy motor.

    Returns
    -------
    pandas.DataFrame
        Columns fault, velocity_m_s, and the error of each regression [m/s], by its name in `MODELS`.
    """
    fits = {words: fit(points, names, "velocity_m_s") for words, names in MODELS.items()}
    for words in ("none", *FAULTS):
        faulty = replace(p, load_force=10.0)
        if words in FAULTS:
            name, place, value = FAULTS[words]
            faulty = replace(faulty, **{name: with_changed_value(getattr(faulty, name), place, value)})
        point = operate(faulty, FREQUENCY, 200.0)
        read = dict(zip(ELECTRODES, np.abs(point.tones).tolist(), strict=True)) | {DRIVE: 200.0}
        said = {
            model: float(found.params["const"]) + sum(float(found.params[name]) * read[name] for name in MODELS[model])
            for model, found in fits.items()
        }
        errors = {model: value - point.velocity for model, value in said.items()}
        yield {"fault": words, "velocity_m_s": point.velocity, **errors}


def motor_spectra(p: DiaphragmMotorParameters) -> pd.DataFrame:
    """Return mean and harmonics of the motor's signals at 480 Hz, for every drive, without load: Figure 21.

    Returns
    -------
    pandas.DataFrame
        Columns signal, peak_to_peak_v, harmonic (0 is the mean), frequency_hz, amplitude (in the signal's unit) and
        relative_percent (of the first harmonic).
    """
    return pd.concat([_spectra(p, swing) for swing in SWINGS], ignore_index=True)


@as_stacked_table
def _spectra(p: DiaphragmMotorParameters, swing: float) -> Frames:
    a_cycle = ceil(1.0 / (FREQUENCY * LONGEST_STEP) - 1e-9)
    step = 1.0 / (FREQUENCY * a_cycle)
    settling, cycles = ceil(2.0 * SETTLING_TIME * FREQUENCY) * a_cycle, 20
    drive = motor_drive(FREQUENCY, swing, (settling + cycles * a_cycle) * step, step)
    states = run_motor(p, drive, step)
    bent = deflections(states, drive, p)
    signals = {
        "deflection of A1 [m]": bent[:, 0],
        "deflection of A4 [m]": bent[:, 3],
        "pressure in chamber 4 [Pa]": states[:, 3],
        "outlet flow [m³/s]": states[:, FLOWS][:, -1],
        "velocity [m/s]": states[:, VELOCITY],
    }
    for name, values in signals.items():
        lines = np.abs(harmonics(values[settling:], HARMONICS, cycles))
        order = np.arange(HARMONICS + 1)
        columns = {"harmonic": order, "frequency_hz": order * FREQUENCY, "amplitude": lines}
        relative = {"relative_percent": 100.0 * lines / lines[1]}
        yield {"signal": name, DRIVE: swing, **columns, **relative}


@as_table
def distortion_table(spectra: pd.DataFrame) -> Rows:
    """Return the total harmonic distortion of each signal, with one column for each drive.

    Parameters
    ----------
    spectra : pandas.DataFrame
        Table from `motor_spectra`.

    Returns
    -------
    pandas.DataFrame
        Columns signal, and thd_100 to thd_300 [percent], by drive.
    """
    for name, part in spectra.groupby("signal", sort=False):
        lines = {float(str(swing)): some["amplitude"].to_numpy().astype(complex) for swing, some in part.groupby(DRIVE)}
        found = {f"thd_{swing:g}": 100.0 * total_harmonic_distortion(line) for swing, line in lines.items()}
        yield {"signal": name, **found}
