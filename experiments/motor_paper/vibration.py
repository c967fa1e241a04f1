"""The diaphragm-motor paper's linear models: poles by sign convention, Bode, Nyquist, fractional damping."""

from dataclasses import replace
from math import gamma, pi
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from experiments.page.frames import Frames, Rows, as_stacked_table, as_table
from plant.motor_paper.fractional import grunwald_letnikov
from plant.motor_paper.hysteresis_model import HysteresisParameters, linearised
from plant.motor_paper.vibration_model import VibrationParameters, exact_response, first_mode, state_space

if TYPE_CHECKING:
    import control

FREQUENCIES = np.geomspace(10.0, 1e4, 1201)
"""Frequencies of the responses [Hz]."""

TUNED_FREQUENCY = 480.0
"""The published resonance, section 7.1 [Hz]."""

ORDERS = (0.5, 1.0, 1.5)
"""Orders in Figures 7 to 9."""


def _vibration_models(p: VibrationParameters) -> "dict[str, control.StateSpace]":
    """Return equations 1 to 4 as models of python-control (errata M1 to M4)."""
    return {
        "equations 1 and 2, signs mended": state_space(p),
        "equations 1 and 2, as printed": state_space(p, signs="printed"),
        "equation 4, signs mended": state_space(p, massless=True),
    }


@as_table
def pole_table(p: VibrationParameters) -> Rows:
    """Return the poles of each model, one for each conjugate pair.

    Returns
    -------
    pandas.DataFrame
        Columns model, real_rad_s, imaginary_rad_s, frequency_hz, damping_ratio and stable.
    """
    for name, model in _all_models(p).items():
        for pole in sorted(model.poles(), key=abs):
            if pole.imag >= 0.0:
                yield {
                    "model": name,
                    "real_rad_s": float(pole.real),
                    "imaginary_rad_s": float(pole.imag),
                    "frequency_hz": float(abs(pole) / (2.0 * pi)),
                    "damping_ratio": float(-pole.real / abs(pole)),
                    "stable": bool(pole.real < 0.0),
                }


def _all_models(p: VibrationParameters) -> dict[str, Any]:
    return {**_vibration_models(p), "equation 20, small voltages": linearised(HysteresisParameters())}


@as_table
def margin_table(p: VibrationParameters) -> Rows:
    """Return margins of the loops in Figures 22, 23, 31 and 32: each model times a gain, with feedback.

    The gain normalises the model's own gain at rest to 1. A loop is stable if its closed-loop poles are; Nyquist's
    count of clockwise encirclements agrees only together with the open loop's unstable poles (errata M30).

    Returns
    -------
    pandas.DataFrame
        Columns model, gain_margin (infinite if none), phase_margin_deg, crossover_hz, open_unstable_poles, turns,
        closed_unstable_poles and stable.
    """
    import control  # slow to import, and few callers need it

    for name, model in _all_models(p).items():
        loop = model / float(np.real(model.dcgain()))
        gain, phase, _, crossover = control.margin(loop)
        closed_loop: Any = control.feedback(loop, 1)
        open_poles, closed = np.real(loop.poles()), np.real(closed_loop.poles())
        omega = _frequencies_near_poles(np.asarray(loop.poles()))
        turns = control.nyquist_response(loop, omega=omega, warn_encirclements=False).count
        yield {
            "model": name,
            "gain_margin": float(gain),
            "phase_margin_deg": float(phase),
            "crossover_hz": float(crossover) / (2.0 * pi),
            "open_unstable_poles": int(np.sum(open_poles > 0.0)),
            "turns": int(turns),
            "closed_unstable_poles": int(np.sum(closed > 0.0)),
            "stable": bool(np.all(closed < 0.0)),
        }


def _frequencies_near_poles(
    poles: "np.ndarray[Any, np.dtype[np.complex128]]",
) -> "np.ndarray[Any, np.dtype[np.float64]]":
    """Angular frequencies fine enough for a resonance with a relative width of 1/10000, which a regular grid misses."""
    near = [abs(pole) + abs(pole.real) * np.linspace(-300.0, 300.0, 2401) for pole in poles if pole.imag > 0.0]
    grid = np.concatenate([np.geomspace(1.0, 1e6, 2001), *near])
    return np.unique(grid[grid > 0.0])


def response_table(p: VibrationParameters) -> pd.DataFrame:
    """Return the frequency responses of Figures 22 and 23, each relative to its own gain at rest.

    Returns
    -------
    pandas.DataFrame
        Columns model, frequency_hz, gain [dimensionless], phase_deg.
    """
    return pd.concat([response_rows(name, model) for name, model in _vibration_models(p).items()], ignore_index=True)


def response_rows(name: str, model: Any) -> pd.DataFrame:
    """Return the frequency response of one model relative to its own gain at rest (equation 13).

    Returns
    -------
    pandas.DataFrame
        Table like that of `response_table`.
    """
    near = [abs(pole) / (2.0 * pi) * np.linspace(0.9, 1.1, 101) for pole in model.poles() if pole.imag > 0.0]
    frequency = np.unique(np.concatenate([FREQUENCIES, *near]))
    values = np.asarray(model(2j * pi * frequency)).ravel() / float(np.real(model.dcgain()))
    phase = np.degrees(np.unwrap(np.angle(values)))
    columns = {"frequency_hz": frequency, "gain": np.abs(values), "phase_deg": phase}
    return pd.DataFrame({"model": name, **columns})


@as_table
def tuning_table(p: VibrationParameters) -> Rows:
    """Return the effect of stiffness and damping on the first mode, as section 5.1.1 tunes them.

    Parameters
    ----------
    p : VibrationParameters
        The model from which one value at a time is changed.

    Returns
    -------
    pandas.DataFrame
        Columns changed, factor, frequency_hz, damping_ratio, peak_gain (relative to that at rest) and decay_time_s
        (decay to a tenth).
    """
    for name in ("diaphragm_stiffness", "fluid_stiffness", "load_stiffness", "cylinder_mass", "damping"):
        for factor in (0.5, 1.0, 2.0):
            model = state_space(replace(p, **{name: factor * getattr(p, name)}), massless=True)
            pole = first_mode(model.poles())
            yield {
                "changed": name,
                "factor": factor,
                "frequency_hz": abs(pole) / (2.0 * pi),
                "damping_ratio": -pole.real / abs(pole),
                "peak_gain": float(response_rows(name, model)["gain"].max()),
                "decay_time_s": -np.log(10.0) / pole.real,
            }


@as_stacked_table
def figures_7_to_9() -> Frames:
    """Return fractional integral and derivative of t^2, exactly and sampled, Figures 7 to 9 and equation 6 (errata M6).

    Returns
    -------
    pandas.DataFrame
        Columns order, time_s, integral, derivative (exact), sampled_integral and sampled_derivative (1 ms).
    """
    time = np.linspace(0.0, 1.0, 1001)
    square = np.square(time)
    for a in ORDERS:
        yield {
            "order": a,
            "time_s": time,
            "integral": 2.0 * time ** (2.0 + a) / gamma(3.0 + a),
            "derivative": 2.0 * time ** (2.0 - a) / gamma(3.0 - a),
            "sampled_integral": grunwald_letnikov(square, -a, 1e-3),
            "sampled_derivative": grunwald_letnikov(square, a, 1e-3),
        }


def _with_order(p: VibrationParameters, order: float) -> VibrationParameters:
    """Return a model with a damper of another order but the same force amplitude at 480 Hz (errata M5)."""
    size = p.damping * (2.0 * pi * TUNED_FREQUENCY) ** (1.0 - order)
    return replace(p, damping=0.0, fractional_damping=size, fractional_order=order)


@as_stacked_table
def fractional_table(p: VibrationParameters) -> Frames:
    """Return responses with fractional damping, exact and by Oustaloup's approximation.

    Returns
    -------
    pandas.DataFrame
        Columns order, frequency_hz, gain and imitated_gain [m/N].
    """
    for order in ORDERS:
        q = _with_order(p, order)
        imitated = np.abs(np.asarray(state_space(q)(2j * pi * FREQUENCIES)).ravel())
        columns = {
            "frequency_hz": FREQUENCIES,
            "gain": np.abs(exact_response(q, FREQUENCIES)),
            "imitated_gain": imitated,
        }
        yield {"order": order, **columns}
