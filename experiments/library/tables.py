"""The nine-condition library beside Table 6, as tables: gains and bandwidths, poles and zeros, responses."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from estimation.identification.model.linear_model import LinearModel
from experiments.circuit.passes import CHANNELS, SAMPLE_TIME
from experiments.nine_conditions.printed_transfer_functions import printed_model
from experiments.nine_conditions.transfer_functions import jump_ratio
from experiments.page.frames import Frames, Rows, as_stacked_table, as_table

FREQUENCIES = np.geomspace(0.5, 100.0, 60)
"""Frequencies of the responses [Hz]."""


def published_model(condition: str) -> LinearModel:
    """Return a model of Table 6 at the inferred sample time (errata E14).

    Returns
    -------
    LinearModel
        Motor speed [rad/s] to velocity [m/s].
    """
    printed = printed_model(condition)
    return LinearModel(np.array(printed["numerator"]), np.array(printed["denominator"]), SAMPLE_TIME, *CHANNELS)


@as_table
def library_table(models: Mapping[str, LinearModel]) -> Rows:
    """Return the library beside Table 6, condition by condition.

    Returns
    -------
    pandas.DataFrame
        Gain with standard deviation, the interval of the printed gain, natural frequencies and bandwidth of both, and
        the share of the gain that acts immediately (``jump_ratio``).
    """
    for name, model in models.items():
        printed, published = printed_model(name), published_model(name)
        yield {
            "condition": name,
            "dc_gain": model.dc_gain,
            "dc_gain_std": model.dc_gain_std,
            "published_gain_low": printed["dc_gain"]["interval"][0],
            "published_gain_high": printed["dc_gain"]["interval"][1],
            "slowest_hz": _frequencies(model).min(),
            "published_slowest_hz": _frequencies(published).min(),
            "bandwidth_hz": model.bandwidth_hz,
            "bandwidth_std_hz": model.bandwidth_std_hz,
            "published_bandwidth_hz": published.bandwidth_hz,
            "jump_ratio": jump_ratio(model),
            "published_jump_ratio": jump_ratio(published),
            "fit_percent": model.fit_percent,
            "cancellations": len(model.cancellations),
        }


def root_table(models: Mapping[str, LinearModel]) -> pd.DataFrame:
    """Return poles and zeros of the library beside those of Table 6.

    Returns
    -------
    pandas.DataFrame
        One row for each root in z: condition, ``kind`` (pole or zero), ``source`` (library or Table 6), ``real``,
        ``imag``, and their uncertainties: standard deviations of the library's roots, half widths from the printed
        digits.
    """
    rows: list[tuple[object, ...]] = []
    for name, model in models.items():
        printed = printed_model(name)
        for kind in ("pole", "zero"):
            ours = zip(getattr(model, f"{kind}s"), getattr(model, f"{kind}_std"), strict=True)
            rows += [(name, kind, "library", root.real, root.imag, std.real, std.imag) for root, std in ours]
            theirs = zip(printed[f"{kind}s"], printed[f"{kind}_half_width"], strict=True)
            rows += [(name, kind, "Table 6", *root, *half) for root, half in theirs]
    names = ["condition", "kind", "source", "real", "imag", "real_spread", "imag_spread"]
    return pd.DataFrame(rows, columns=names)


@as_stacked_table
def response_table(models: Mapping[str, LinearModel]) -> Frames:
    """Return the gain of the library's models over frequency, with 95 % bands, beside Table 6's.

    Returns
    -------
    pandas.DataFrame
        Columns condition, ``frequency_hz``, ``gain``, ``gain_low``, ``gain_high``, ``published_gain``
        [m/s per rad/s].
    """
    for name, model in models.items():
        band = model.frequency_response(FREQUENCIES, ci=0.95)
        published = np.abs(published_model(name).frequency_response(FREQUENCIES))
        columns = {"gain": np.abs(band.response), "gain_low": band.gain_low, "gain_high": band.gain_high}
        columns |= {"published_gain": published}
        yield {"condition": name, "frequency_hz": FREQUENCIES, **columns}


def _frequencies(model: LinearModel) -> np.ndarray:
    return np.abs(np.log(model.poles.astype(np.complex128))) / (2.0 * np.pi * model.sample_time)
