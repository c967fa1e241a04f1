"""From a log to a linear model in one call."""

import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from estimation.arrays import Array
from estimation.identification.choose import STRUCTURES, choose_model
from estimation.identification.design.sticking import is_sticking, rest_shares
from estimation.identification.fit.answer_at_once import at_once_note
from estimation.identification.fit.feedback import FEEDBACK_SAMPLES, feedback_note
from estimation.identification.fit.fitted import CovarianceKind
from estimation.identification.fit.regulated import regulated_note
from estimation.identification.free_run.from_records import without_gaps
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.notes import IdentificationCode
from estimation.identification.signals.preprocess import resample, zero_phase_filter
from estimation.identification.structure_names import StructureName
from plant.errors import LogError, LogWarning
from plant.log.record import Record

RESTING_SAMPLES = 100_000
"""Samples that are asked for rests, from the beginning."""


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
    structure: StructureName | None = "output-error",
    orders: Sequence[int] | None = None,
    estimate_dead_time: bool = False,
    covariance: CovarianceKind | None = None,
) -> LinearModel:
    """Identify a record's transfer function, by default in the form of Table 6 of the EHA paper.

    The paper states neither unit nor sample time of Table 6; rad/s to m/s at 1 ms is the reading that fits its gains
    and resonances (errata E14).

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
    structure : str or None
        What to fit; None compares ARX, ARMAX, output error and Box-Jenkins on data held back.
    orders : sequence of int, optional
        Orders that are compared by BIC instead of `n_denominator`; the numerator follows.
    estimate_dead_time : bool
        Whether the delay is estimated instead of given.
    covariance : {"white", "coloured", "auto"}, optional
        As `fit_output_error`; white unless told, or filtered.

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
        If the output is differentiated from position, input samples are bridged, the input was fed back, or the
        order was to be chosen for a piston that sticks.
    """
    u, y = record_signals(
        record, output=output, input=input, sample_time=sample_time, filter_cutoff_hz=filter_cutoff_hz
    )
    default: CovarianceKind = "white" if filter_cutoff_hz is None else "coloured"
    choice = choose_model(
        u,
        y,
        sample_time,
        orders=(n_denominator,) if orders is None else orders,
        delay=None if estimate_dead_time else delay,
        structures=STRUCTURES if structure is None else (structure,),
        n_numerator=n_numerator if orders is None else None,
        covariance=covariance or default,
        input_name=input,
        output_name=output,
    )
    # a filter that looks ahead makes outputs follow future inputs, as feedback does
    if filter_cutoff_hz is None and u.size == len(record) and output in record:
        _warn_of_feedback(choice.model, u, y)
    if choice.orders is not None and output == "velocity_m_s":
        _warn_of_rest(choice.model, choice.orders["fit_percent"].to_dict(), u, y)
    return choice.model


def record_signals(
    record: Record,
    *,
    output: str = "velocity_m_s",
    input: str = "motor_speed_rad_s",  # noqa: A002 - the word that the command and its JSON use
    sample_time: float = 1e-3,
    filter_cutoff_hz: float | None = None,
) -> tuple[Array, Array]:
    """Return input and output of a record as `identify_record` fits them.

    Parameters
    ----------
    sample_time : float
        Of the model [s].
    filter_cutoff_hz : float, optional
        Zero-phase low-pass of both [Hz].

    Returns
    -------
    tuple of ndarray, shape (n,)
        Input without gaps, and output, NaN where missing [in the channels' units].

    Raises
    ------
    LogError
        If a channel is missing.

    Warns
    -----
    LogWarning
        If the output is differentiated from position, or input samples are bridged.
    """
    measured = _output_signal(record, output)
    driven = without_gaps(record[input], input)
    u = resample(driven, record.sample_time, sample_time)
    y = resample(measured, record.sample_time, sample_time)
    return (u, y) if filter_cutoff_hz is None else zero_phase_filter(u, y, sample_time, cutoff_hz=filter_cutoff_hz)


def _warn_of_rest(model: LinearModel, fit_percents: Mapping[Any, float], u: Array, y: Array) -> None:
    part = slice(0, RESTING_SAMPLES)
    measured, linear = rest_shares(u[part], y[part], model.sample_time)
    if is_sticking(measured, linear):
        fits = ", ".join(f"{fit:.1f} % ({order})" for order, fit in fit_percents.items())
        said = IdentificationCode.PISTON_RESTS.note(
            output=model.output_name,
            input=model.input_name,
            measured=measured,
            linear=linear,
            order=model.denominator.size - 1,
            fits=fits,
        )
        warnings.warn(LogWarning(said), stacklevel=3)


def _warn_of_feedback(model: LinearModel, u: Array, y: Array) -> None:
    part = slice(0, FEEDBACK_SAMPLES)
    if not model.is_stable:
        return
    residual = y[part] - model.simulate(u[part], initial=model.initial_state)
    names = model.input_name, model.output_name
    said = at_once_note(model, u, y) or feedback_note(residual, u[part], names) or regulated_note(u, y, names)
    if said is not None:
        warnings.warn(LogWarning(said), stacklevel=3)


def _output_signal(record: Record, name: str) -> Array:
    if name in record or name != "velocity_m_s" or "position_m" not in record:
        return record[name]
    if len(record) < 3:
        raise LogError(f"velocity by differentiation needs 3 samples of 'position_m' or more, got {len(record)}")
    warnings.warn(LogWarning(IdentificationCode.VELOCITY_DIFFERENTIATED.note()), stacklevel=3)
    return np.gradient(record["position_m"], record.sample_time)
