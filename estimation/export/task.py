"""The filtering task of a controller: model, first belief and noise, from a rig and a log."""

from collections.abc import Mapping
from dataclasses import replace

from estimation.eha.by_flow_filter import FORMS as CHAMBERS
from estimation.eha.by_flow_filter import drive_noise
from estimation.engine.contract import FilterProblem
from estimation.export.flow import FLOW_FILTER, STATES, STDS
from estimation.filters.run import available_channels, filter_problem
from estimation.log_checks.channel_names import PRESSURE
from estimation.log_checks.first_belief import PRESSURE_NOISE_LOGGED, START_STD, first_belief, first_load
from estimation.models.augment import augmented, augmented_prior
from estimation.models.chambers import chamber_belief
from estimation.models.eha_forms import FORMS
from estimation.models.model import ProcessModel
from estimation.tuning.tuning import tune
from plant.eha.model import EhaParameters
from plant.errors import LogError, require_known
from plant.log.record import Record

CHAMBER_FORMS = {model.name: (model, makeup) for model, makeup in CHAMBERS}
"""Forms with modelled chambers, each with its first guess of the make-up conductance [m^3/(s Pa)]."""

EXPORTED_FORMS: Mapping[str, ProcessModel] = {
    **FORMS,
    "flow": FLOW_FILTER,
    **{name: model for name, (model, _) in CHAMBER_FORMS.items()},
}
"""Process models of which a filter can be exported, by name."""


def filter_task(
    record: Record,
    parameters: EhaParameters,
    form: str,
    *,
    start: float | None = None,
    states: tuple[str, ...] = (),
    tuned: bool = False,
) -> FilterProblem:
    """Return the task of a filter that will run elsewhere.

    Parameters
    ----------
    record : Record
        A log of the bench, with the sample rate, channels and sensor noise that the filter will have.
    form : str
        One of `EXPORTED_FORMS`.
    start : float, optional
        First guess of bulk modulus [Pa]; by default the actuator's.
    states : tuple of str
        Quantities to estimate besides bulk modulus, from `estimation.models.augment.AUGMENTABLE`.
    tuned : bool
        Whether the noise levels are those of maximum likelihood on the log.

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
    guess = parameters.bulk_modulus if start is None else start
    if model is FLOW_FILTER or form in CHAMBER_FORMS:
        return _flow_task(record, parameters, form, guess)
    belief, channels = first_belief(model, record, guess, START_STD), available_channels(model, record)
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


def _flow_task(record: Record, parameters: EhaParameters, form: str, guess: float) -> FilterProblem:
    """Return the task of a filter that is driven by measured flows and measures only differential pressure."""
    if PRESSURE not in record:
        raise LogError(f"the {form} form needs {PRESSURE}, the record has {', '.join(record)}")
    load, model = first_load(record), EXPORTED_FORMS[form]
    if form not in CHAMBER_FORMS:
        prior = chamber_belief(parameters, load, guess, states=STATES, stds=STDS)
        return replace(filter_problem(model, prior, record, parameters), model=model)
    prior = chamber_belief(parameters, load, guess, makeup=CHAMBER_FORMS[form][1])
    noise: Mapping[str, float] = dict.fromkeys(("pressure_a_pa", "pressure_b_pa"), drive_noise(record, parameters))
    return replace(filter_problem(model, prior, record, parameters, noise=noise), model=model)
