"""System identification: from samples of input and output to a transfer function with its uncertainty.

Modules are imported when one of their names is first used.
"""

from typing import TYPE_CHECKING

from plant.lazy import lazy_getattr

if TYPE_CHECKING:
    from estimation.identification.choose import STRUCTURES as STRUCTURES
    from estimation.identification.choose import Choice as Choice
    from estimation.identification.choose import choose_model as choose_model
    from estimation.identification.design.dead_time import estimate_delay as estimate_delay
    from estimation.identification.design.input_design import Limits as Limits
    from estimation.identification.design.input_design import multisine_for as multisine_for
    from estimation.identification.design.input_design import prbs_for as prbs_for
    from estimation.identification.design.input_design import rank_inputs as rank_inputs
    from estimation.identification.fit.arx import fit_arx as fit_arx
    from estimation.identification.fit.continuous import fit_continuous as fit_continuous
    from estimation.identification.fit.instrumental import fit_instrumental as fit_instrumental
    from estimation.identification.fit.order import OrderTest as OrderTest
    from estimation.identification.fit.order import markov_parameters as markov_parameters
    from estimation.identification.fit.order import order_table as order_table
    from estimation.identification.fit.order import order_test as order_test
    from estimation.identification.fit.output_error import fit_output_error as fit_output_error
    from estimation.identification.fit.prediction_error import fit_armax as fit_armax
    from estimation.identification.fit.prediction_error import fit_box_jenkins as fit_box_jenkins
    from estimation.identification.fit.profile_interval import dc_gain_interval as dc_gain_interval
    from estimation.identification.fit.subspace import SubspaceFit as SubspaceFit
    from estimation.identification.fit.subspace import fit_subspace as fit_subspace
    from estimation.identification.fit.validate import Validation as Validation
    from estimation.identification.fit.validate import estimate_initial_state as estimate_initial_state
    from estimation.identification.fit.validate import validate as validate
    from estimation.identification.from_record import identify_record as identify_record
    from estimation.identification.model.linear_model import LinearModel as LinearModel
    from estimation.identification.model.table import model_table as model_table
    from estimation.identification.signals.automatic_window import automatic_response as automatic_response
    from estimation.identification.signals.etfe import FrequencyResponse as FrequencyResponse
    from estimation.identification.signals.etfe import etfe as etfe
    from estimation.identification.signals.etfe import etfe_welch as etfe_welch
    from estimation.identification.signals.preprocess import detrend as detrend
    from estimation.identification.signals.preprocess import resample as resample
    from estimation.identification.signals.preprocess import zero_phase_filter as zero_phase_filter

__getattr__ = lazy_getattr(__name__, __file__)
