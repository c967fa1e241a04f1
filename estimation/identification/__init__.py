"""System identification: from input and output samples to a transfer function that says how sure it is."""

from estimation.identification.etfe import FrequencyResponse, etfe, etfe_welch
from estimation.identification.from_record import identify_record
from estimation.identification.linear_model import LinearModel, model_table
from estimation.identification.order import OrderTest, markov_parameters, order_table, order_test
from estimation.identification.output_error import fit_output_error
from estimation.identification.preprocess import detrend, resample, zero_phase_filter
from estimation.identification.validate import Validation, estimate_initial_state, validate

__all__ = [
    "FrequencyResponse",
    "LinearModel",
    "OrderTest",
    "Validation",
    "detrend",
    "estimate_initial_state",
    "etfe",
    "etfe_welch",
    "fit_output_error",
    "identify_record",
    "markov_parameters",
    "model_table",
    "order_table",
    "order_test",
    "resample",
    "validate",
    "zero_phase_filter",
]
