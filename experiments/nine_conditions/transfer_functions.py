"""Section 4: nine transfer functions, the empirical frequency response, the order, and the effect of filtering."""

import warnings
from collections.abc import Mapping

import numpy as np
import pandas as pd

from estimation.identification.fit.order import order_test
from estimation.identification.fit.output_error import fit_output_error
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.signals.etfe import etfe
from estimation.identification.signals.preprocess import zero_phase_filter
from experiments.nine_conditions.settings import StudySettings
from experiments.page.frames import Frames, Rows, as_stacked_table, as_table, cell
from experiments.published import load
from experiments.published.library import read_library
from experiments.running.executors import map_in_parallel
from experiments.running.progress import Track, without_progress
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS
from faults.eha.bank import IDENTIFICATION_TIME, identification_run
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT
from plant.errors import LogWarning
from plant.log.record import Record

COEFFICIENTS = ("b0", "b1", "b2", "a1", "a2")

ROUNDING = 0.5
"""Half a unit of the last printed digit: the rounding error of Table 6."""

RESPONSE_FREQUENCIES = np.geomspace(0.5, 100.0, 80)
"""Frequencies of the response curves [Hz]."""


def identification_study(
    rig: EhaParameters, settings: StudySettings, track: Track = without_progress
) -> tuple[Mapping[str, LinearModel], Mapping[str, Record]]:
    """Return the library that ships, and nine runs of section 4's test of the circuit beside it.

    Returns
    -------
    tuple of Mapping
        Models and test records, by condition.
    """

    def test(name: str) -> Record:
        rng, seconds = stream(settings.seed, "identification", name), settings.identification_duration
        return identification_run(rig, CONDITIONS[name], rng, duration=seconds, plant=CIRCUIT)

    done = track(map_in_parallel(test, CONDITIONS), len(CONDITIONS), description="testing nine conditions")
    return read_library(), dict(zip(CONDITIONS, done, strict=True))


@as_table
def transfer_function_table(models: Mapping[str, LinearModel]) -> Rows:
    """Return the library beside Table 6.

    Returns
    -------
    pandas.DataFrame
        One row for each condition: coefficients with standard deviations, gain, bandwidth, fit; the published
        coefficients, and the range of gains that their rounding allows (errata E14).
    """
    published = load("transfer_functions").set_index("condition")
    for name, model in models.items():
        values = [*model.numerator, *model.denominator[1:]]
        printed = {key: cell(published, name, key) for key in COEFFICIENTS}
        low, high = printed_gain_interval([repr(value) for value in printed.values()])
        yield {
            "condition": name,
            **dict(zip(COEFFICIENTS, values, strict=True)),
            **{f"{key}_std": std for key, std in zip(COEFFICIENTS, model.coefficient_std, strict=True)},
            "dc_gain": model.dc_gain,
            "dc_gain_std": model.dc_gain_std,
            "bandwidth_hz": model.bandwidth_hz,
            "fit_percent": model.fit_percent,
            "jump_ratio": jump_ratio(model),
            **{f"published_{key}": value for key, value in printed.items()},
            "published_dc_gain_low": low,
            "published_dc_gain_high": high,
        }


def jump_ratio(model: LinearModel) -> float:
    """Return the share of a model's gain that acts in the sample of the step: 0 if the output follows a mass (E15).

    Returns
    -------
    float
        ``b_0`` over the gain at zero frequency [dimensionless].

    Examples
    --------
    >>> jump_ratio(LinearModel([0.5, 0.0, -0.4], [1.0, -0.9], 1e-3, "motor_speed_rad_s", "velocity_m_s"))
    0.5
    """
    return float(model.numerator[0]) / model.dc_gain


def printed_gain_interval(printed: list[str]) -> tuple[float, float]:
    """Return the gains at zero frequency that a printed model's rounding allows (errata E14).

    Parameters
    ----------
    printed : list of str
        b0, b1, b2, a1, a2 as printed, four significant digits.

    Returns
    -------
    tuple of float
        Lowest and highest gain.

    Examples
    --------
    >>> low, high = printed_gain_interval(["0.0001977", "-0.000361", "0.0001635", "-1.893", "0.894"])
    >>> f"{low:.1e} {high:.1e}"
    '3.2e-05 7.8e-04'
    """
    values = [float(text) for text in printed]
    half = [ROUNDING * 10.0 ** (np.floor(np.log10(abs(value))) - 3.0) for value in values]
    top, bottom = sum(values[:3]), 1.0 + sum(values[3:])
    top_half, bottom_half = sum(half[:3]), sum(half[3:])
    corners = [(top + s * top_half) / (bottom + r * bottom_half) for s in (-1.0, 1.0) for r in (-1.0, 1.0)]
    return float(min(corners)), float(max(corners))


@as_stacked_table
def response_curves(models: Mapping[str, LinearModel], records: Mapping[str, Record]) -> Frames:
    """Return the models' frequency responses and the empirical ones, in long form.

    Returns
    -------
    pandas.DataFrame
        Columns condition, source (``model`` or ``etfe``), frequency_hz, gain, phase_deg, coherence.
    """
    lowest, highest = RESPONSE_FREQUENCIES[[0, -1]]
    for name, model in models.items():
        response = model.frequency_response(RESPONSE_FREQUENCIES)
        fitted = _response_columns(RESPONSE_FREQUENCIES, response, np.ones(len(response)))
        measured = measured_response(records[name], 1000, lowest, highest)
        yield {"condition": name, "source": "model", **fitted}
        yield {"condition": name, "source": "etfe", **measured}


def measured_response(record: Record, lag_window: int, lowest: float, highest: float) -> dict[str, np.ndarray]:
    """Return the empirical frequency response of a test, within a band.

    Parameters
    ----------
    lag_window : int
        Longest lag of the correlations used to compute the response [count].
    lowest, highest : float
        Ends of the band [Hz].

    Returns
    -------
    dict[str, ndarray]
        ``frequency_hz``, ``gain``, ``phase_deg``, ``coherence``.
    """
    found = etfe(record["motor_speed_rad_s"], record["velocity_m_s"], record.sample_time, lag_window=lag_window)
    inside = (found.frequency_hz >= lowest) & (found.frequency_hz <= highest)
    return _response_columns(found.frequency_hz[inside], found.response[inside], found.coherence[inside])


def _response_columns(frequency: np.ndarray, response: np.ndarray, coherence: np.ndarray) -> dict[str, np.ndarray]:
    """Return a frequency response as the columns ``frequency_hz``, ``gain``, ``phase_deg`` and ``coherence``."""
    phase = np.degrees(np.unwrap(np.angle(response)))
    return {"frequency_hz": frequency, "gain": np.abs(response), "phase_deg": phase, "coherence": coherence}


def order_table(record: Record, rng: np.random.Generator) -> pd.DataFrame:
    """Return singular values against their noise floor, for Figure 7.

    Returns
    -------
    pandas.DataFrame
        Columns index, hankel, hankel_floor, projected, projected_floor.
    """
    test = order_test(record["motor_speed_rad_s"], record["velocity_m_s"], rng=rng)
    count = min(len(test.hankel_singular_values), len(test.projected_singular_values), 12)
    return pd.DataFrame(
        {
            "index": np.arange(1, count + 1),
            "hankel": test.hankel_singular_values[:count],
            "hankel_floor": test.hankel_noise_floor,
            "projected": test.projected_singular_values[:count],
            "projected_floor": test.projected_noise_floor,
            "suggested_order": test.suggested_order,
        }
    )


@as_table
def filtering_table(rng: np.random.Generator, duration: float) -> Rows:
    """Return the effect of zero-phase filtering of only the output on a fit, for a plant with known poles.

    Section 4 filters the output only. The plant here is a strictly proper 30 Hz resonance with damping 0.6, driven as
    in section 4 with 5 % noise (errata E15).

    Parameters
    ----------
    duration : float
        Duration of the test [s].

    Returns
    -------
    pandas.DataFrame
        One row for each variant: pole frequency, damping, gain, jump ratio.
    """
    frequency, damping, T = 2.0 * np.pi * 30.0, 0.6, IDENTIFICATION_TIME
    decay, turn = np.exp(-damping * frequency * T), frequency * np.sqrt(1.0 - damping**2) * T
    f = np.array([1.0, -2.0 * decay * np.cos(turn), decay**2])
    b = np.array([0.0, 0.5, 0.5]) * f.sum()
    plant = LinearModel(b, f, T, "motor_speed_rad_s", "velocity_m_s", delay=0)
    u = np.repeat(rng.choice([-1.0, 1.0], size=round(duration / 0.05)), 50)
    y = plant.simulate(u)
    y = y + 0.05 * np.std(y) * rng.standard_normal(len(y))
    yield _pole_row("truth", plant)
    yield _pole_row("neither filtered", _fit(u, y))
    yield _pole_row("both filtered", _fit(*zero_phase_filter(u, y, T)))
    with warnings.catch_warnings(action="ignore", category=LogWarning):
        only_output = zero_phase_filter(u, y, T, filter_input=False)
    yield _pole_row("output only, as in section 4", _fit(*only_output))


def _fit(u: np.ndarray, y: np.ndarray) -> LinearModel:
    return fit_output_error(u, y, IDENTIFICATION_TIME, n_numerator=3, n_denominator=2)


def _pole_row(variant: str, model: LinearModel) -> dict[str, object]:
    pole = np.log(model.poles[np.argmax(model.poles.imag)]) / model.sample_time
    return {
        "variant": variant,
        "pole_frequency_hz": abs(pole) / (2.0 * np.pi),
        "damping": -pole.real / abs(pole),
        "dc_gain": model.dc_gain,
        "jump_ratio": jump_ratio(model),
    }
