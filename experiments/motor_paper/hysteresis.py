"""The diaphragm-motor paper's hysteresis, equations 20 and 21: loops by both laws, and the linear model about them."""

import numpy as np
import pandas as pd

from experiments.motor_paper.vibration import response_rows
from experiments.page.frames import Frames, Rows, as_stacked_table, as_table
from plant.motor_paper.hysteresis_model import (
    HysteresisParameters,
    describing_function,
    harmonics,
    hysteresis_loop,
    linearised,
    loop_area,
    total_harmonic_distortion,
)

LOOP_FREQUENCIES, LOOP_AMPLITUDE = (1.0, 10.0, 100.0, 480.0), 100.0
"""Frequencies and amplitude of the hysteresis loops [Hz, V]."""


@as_stacked_table
def hysteresis_loops(p: HysteresisParameters) -> Frames:
    """Return the loops of Figures 27 and 34, by the law with rates and as printed (errata M21).

    Parameters
    ----------
    p : HysteresisParameters
        The diaphragm, moved slowly: displacement is ``d (u - h)``.

    Returns
    -------
    pandas.DataFrame
        Columns law, frequency_hz, voltage_v, hysteresis_v, displacement_m.
    """
    for law in ("mended", "printed"):
        for frequency in LOOP_FREQUENCIES:
            voltage, hysteresis = hysteresis_loop(p, LOOP_AMPLITUDE, frequency, law=law)
            displacement = p.stroke_a_volt * (voltage - hysteresis)
            columns = {"voltage_v": voltage, "hysteresis_v": hysteresis, "displacement_m": displacement}
            yield {"law": law, "frequency_hz": frequency, **columns}


@as_table
def hysteresis_table(loops: pd.DataFrame) -> Rows:
    """Return the characteristics of each loop.

    Parameters
    ----------
    loops : pandas.DataFrame
        Table from `hysteresis_loops`.

    Returns
    -------
    pandas.DataFrame
        Columns law, frequency_hz, area_v2, width_percent (at zero voltage, relative to the stroke), gain and lag_deg of
        the displacement's first harmonic relative to that without hysteresis, distortion_percent.
    """
    for (law, frequency), loop in loops.groupby(["law", "frequency_hz"]):
        voltage, hysteresis = loop["voltage_v"].to_numpy(), loop["hysteresis_v"].to_numpy()
        left = voltage - hysteresis
        passed = 1.0 - describing_function(voltage, hysteresis)
        yield {
            "law": law,
            "frequency_hz": frequency,
            "area_v2": loop_area(voltage, hysteresis),
            "width_percent": 100.0 * abs(left[0] - left[len(left) // 2]) / np.ptp(left),
            "gain": abs(passed),
            "lag_deg": -np.degrees(np.angle(passed)),
            "distortion_percent": 100.0 * total_harmonic_distortion(harmonics(left, 9)),
        }


def impulse_table(p: HysteresisParameters) -> pd.DataFrame:
    """Return the impulse response of the linearised equation 20, Figure 35.

    Returns
    -------
    pandas.DataFrame
        Columns time_s and displacement_m_per_v_s, after an impulse of 1 V s.
    """
    import control

    response = control.impulse_response(linearised(p), np.linspace(0.0, 4e-3, 2001))
    return pd.DataFrame({"time_s": response.time, "displacement_m_per_v_s": np.asarray(response.outputs).ravel()})


def hysteresis_response(p: HysteresisParameters) -> pd.DataFrame:
    """Return the frequency response of the linearised equation 20, Figures 31 and 32.

    Returns
    -------
    pandas.DataFrame
        Table like that of `response_table`.
    """
    return response_rows("equation 20, small voltages", linearised(p))
