"""The filtering task that a controller gets: model, first belief and noise, from a rig and a log."""

from collections.abc import Mapping
from dataclasses import replace

from estimation.engine.contract import FilterProblem
from estimation.export.flow import FLOW_FILTER, flow_belief
from estimation.filters.run import available_channels, filter_problem
from estimation.log_checks.first_belief import PRESSURE_NOISE_LOGGED, START_STD, first_belief, first_load
from estimation.models.augment import augmented, augmented_prior
from estimation.models.eha_forms import FORMS
from estimation.models.model import ProcessModel
from estimation.tuning.tuning import tune
from plant.eha.model import EhaParameters
from plant.errors import LogError, require_known
from plant.log.record import Record

EXPORTED_FORMS: Mapping[str, ProcessModel] = {**FORMS, "flow": FLOW_FILTER}
"""Process models that a filter can be exported with, by name."""

PRESSURE = "differential_pressure_pa"


def filter_task(
    record: Record,
    parameters: EhaParameters,
    form: str,
    *,
    start: float | None = None,
    start_std: float = START_STD,
    states: tuple[str, ...] = (),
    tuned: bool = False,
) -> FilterProblem:
    """Return the task of a filter that shall run elsewhere.

    Parameters
    ----------
    record : Record
        A log of the bench: its rate, channels and sensor noise are those that the filter will meet.
    parameters : EhaParameters
        The actuator.
    form : str
        One of `EXPORTED_FORMS`.
    start, start_std : float
        First guess of bulk modulus, by default the actuator's, and its standard deviation [Pa].
    states : tuple of str
        What is estimated beside bulk modulus, of `estimation.models.augment.AUGMENTABLE`.
    tuned : bool
        Whether the noise levels are those of greatest likelihood on the log.

    Raises
    ------
    HydrostateError
        If a name is not known.
    LogError
        If the log lacks what the form needs.
    """
    require_known("form", form, EXPORTED_FORMS)
    model = EXPORTED_FORMS[form]
    model.require_drives(record)
    if model is FLOW_FILTER:
        if PRESSURE not in record:
            raise LogError(f"the flow form needs {PRESSURE}, the record has {', '.join(record)}")
        prior = flow_belief(parameters, first_load(record))
        return replace(filter_problem(model, prior, record, parameters), model=model)
    guess = parameters.bulk_modulus if start is None else start
    belief, channels = first_belief(model, record, guess, start_std), available_channels(model, record)
    noise: Mapping[str, float] = {PRESSURE: PRESSURE_NOISE_LOGGED} if PRESSURE in channels else {}
    variances: Mapping[str, float] | None = None
    if tuned:
        found = tune(record, model, belief, parameters, channels=channels, noise=noise)
        noise, variances = found.tuned.noise, found.tuned.variances
    wide = augmented(model, states)
    prior = augmented_prior(wide, belief, parameters)
    problem = filter_problem(
        wide, prior, record, parameters, channels=channels or None, variances=variances, noise=noise
    )
    return replace(problem, model=wide)
