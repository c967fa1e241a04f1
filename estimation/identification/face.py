"""What the package `estimation.identification` offers its users, in one place."""

from estimation.identification.choose import STRUCTURES, Choice, choose_model
from estimation.identification.design.dead_time import estimate_delay
from estimation.identification.design.input_design import Limits, multisine_for, prbs_for, rank_inputs
from estimation.identification.fit.arx import fit_arx
from estimation.identification.fit.continuous import fit_continuous
from estimation.identification.fit.instrumental import fit_instrumental
from estimation.identification.fit.order import OrderTest, markov_parameters, order_table, order_test
from estimation.identification.fit.output_error import fit_output_error
from estimation.identification.fit.prediction_error import fit_armax, fit_box_jenkins
from estimation.identification.fit.profile_interval import dc_gain_interval
from estimation.identification.fit.subspace import SubspaceFit, fit_subspace
from estimation.identification.fit.validate import Validation, estimate_initial_state, validate
from estimation.identification.from_record import identify_record
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.model.table import model_table
from estimation.identification.signals.automatic_window import automatic_response
from estimation.identification.signals.etfe import FrequencyResponse, etfe, etfe_welch
from estimation.identification.signals.preprocess import detrend, resample, zero_phase_filter

__all__ = [
    "STRUCTURES",
    "Choice",
    "FrequencyResponse",
    "Limits",
    "LinearModel",
    "OrderTest",
    "SubspaceFit",
    "Validation",
    "automatic_response",
    "choose_model",
    "dc_gain_interval",
    "detrend",
    "estimate_delay",
    "estimate_initial_state",
    "etfe",
    "etfe_welch",
    "fit_armax",
    "fit_arx",
    "fit_box_jenkins",
    "fit_continuous",
    "fit_instrumental",
    "fit_output_error",
    "fit_subspace",
    "identify_record",
    "markov_parameters",
    "model_table",
    "multisine_for",
    "order_table",
    "order_test",
    "prbs_for",
    "rank_inputs",
    "resample",
    "validate",
    "zero_phase_filter",
]
