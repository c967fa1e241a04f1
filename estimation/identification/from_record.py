"""From a log to a linear model in one verb."""

import warnings

import numpy as np

from estimation.identification.linear_model import FloatArray, LinearModel
from estimation.identification.output_error import fit_output_error
from estimation.identification.preprocess import bridged, resample, zero_phase_filter
from plant.errors import LogError, LogWarning
from plant.record import Record


def identify_record(
    record: Record,
    *,
    output: str = "velocity_m_s",
    input: str = "motor_speed_rad_s",  # noqa: A002 - the word that the command and its JSON use
    sample_time: float = 1e-3,
    n_numerator: int = 3,
    n_denominator: int = 2,
    delay: int = 0,
    filter_cutoff_hz: float | None = None,
) -> LinearModel:
    """Identify a record's transfer function, by default in the form of Table 6 of the EHA paper.

    The paper names neither unit nor sample time of Table 6; rad/s to m/s at 1 ms is the reading that fits its
    gains and resonances (errata E14).

    Parameters
    ----------
    record : Record
        The log. Missing outputs are left out; missing inputs are bridged by straight lines, with a warning.
    output, input : str
        Channel names. Where the record has no ``velocity_m_s``, position is differentiated, with a warning.
    sample_time : float
        Of the model [s]; the record is resampled to it.
    n_numerator, n_denominator, delay : int
        As in `fit_output_error`.
    filter_cutoff_hz : float, optional
        Zero-phase low-pass of input and output before the fit [Hz]; the covariance then allows for the
        coloured residual. None does not filter.

    Returns
    -------
    LinearModel
        From `input` to `output`, named so.

    Raises
    ------
    LogError
        If a channel is missing.
    HydrostateError
        If the channels cannot be fitted.

    Warns
    -----
    LogWarning
        If the output is differentiated from position, or input samples are bridged.
    """
    measured = _output(record, output)
    driven = _without_gaps(record[input], input)
    u = resample(driven, record.sample_time, sample_time)
    y = resample(measured, record.sample_time, sample_time)
    if filter_cutoff_hz is not None:
        u, y = zero_phase_filter(u, y, sample_time, cutoff_hz=filter_cutoff_hz)
    return fit_output_error(
        u,
        y,
        sample_time,
        n_numerator=n_numerator,
        n_denominator=n_denominator,
        delay=delay,
        covariance="white" if filter_cutoff_hz is None else "coloured",
        input_name=input,
        output_name=output,
    )


def _output(record: Record, name: str) -> FloatArray:
    if name in record or name != "velocity_m_s" or "position_m" not in record:
        return record[name]
    if len(record) < 3:
        raise LogError(f"velocity by differentiation needs 3 samples of 'position_m' or more, got {len(record)}")
    warnings.warn(
        "channel 'velocity_m_s' is absent: it is differentiated from 'position_m' by central differences, "
        "which amplifies its noise",
        LogWarning,
        stacklevel=3,
    )
    return np.gradient(record["position_m"], record.sample_time)


def _without_gaps(values: FloatArray, name: str) -> FloatArray:
    n_missing = int(np.count_nonzero(np.isnan(values)))
    if n_missing == 0:
        return values
    warnings.warn(
        f"input {name!r} misses {n_missing} of {values.size} samples: they are bridged by straight lines",
        LogWarning,
        stacklevel=3,
    )
    return bridged(values)
