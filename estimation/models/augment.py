"""Parameters as states: a process model that also estimates leakage, flow bias, friction or entrained air.

Positive parameters are estimated as logarithms, so they stay positive, and a first guess that is wrong by a factor is
as near as one that is wrong by its inverse. The linear friction coefficient may be negative (errata E12).
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from estimation.models.eha_forms import BULK_MODULUS
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel, StateVariable
from plant.compiled.functions import Scalar, absolute
from plant.components.oil import effective_bulk_modulus
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError, require_each_known
from plant.units import notes

AIR_FRACTION = "air_fraction"
"""Entrained air at atmospheric pressure; the state of bulk modulus is then that of the oil without air."""

VAPOUR_PRESSURE = 2e3
"""Vapour pressure of the oil where entrained air is estimated [Pa]; at working pressures it plays no part."""

AUGMENTABLE = (
    "leakage_coefficient",
    "flow_bias",
    "friction_quadratic",
    "friction_linear",
    "friction_coulomb",
    AIR_FRACTION,
)
"""Parameters that may be states beside bulk modulus."""

LARGEST_RATIO = 1e3
"""Largest value of a parameter, over that of the healthy actuator [dimensionless]."""

AIR = StateVariable(AIR_FRACTION, "1", 1e-2, 0.0, 1e-6, 0.2, logarithmic=True)
"""Begins at one percent; the upper limit is that of foam."""


def augmented(model: ProcessModel, names: Sequence[str], drift: Mapping[str, float] | None = None) -> ProcessModel:
    """Return a process model with parameters as further states.

    Parameters
    ----------
    model : ProcessModel
        The model; its step reads the parameters that become states.
    names : sequence of str
        Parameters, from `AUGMENTABLE`.
    drift : Mapping[str, float], optional
        Random-walk intensity of each, by name: of a logarithm [1/s], of the linear friction [(N s/m)^2/s]. Constant, 0,
        where not given.

    Returns
    -------
    ProcessModel
        The model, its further states named as the parameters and last.

    Raises
    ------
    HydrostateError
        If a name is not of `AUGMENTABLE` or comes twice, or air is wanted of a model without differential pressure.

    Examples
    --------
    >>> from estimation.models.eha_forms import PRESSURE_FORM
    >>> [state.name for state in augmented(PRESSURE_FORM, ["leakage_coefficient"]).states][3:]
    ['bulk_modulus_pa', 'leakage_coefficient']
    """
    if not names:
        return model
    require_each_known("a further state", names, AUGMENTABLE)
    if AIR_FRACTION in names and all(state.name != "differential_pressure_pa" for state in model.states):
        raise HydrostateError(
            f"air_fraction needs a model with differential pressure as a state, the {model.name} form has none"
        )
    densities = drift or {}
    states = tuple(replace(_variable(name), noise_density=densities.get(name, 0.0)) for name in names)
    width = model.width

    def step(state: tuple[Scalar, ...], drives: Any, p: Any, h: Scalar) -> tuple[Scalar, ...]:
        base, further = state[:width], dict(zip(names, state[width:], strict=True))
        air = further.pop(AIR_FRACTION, None)
        values = {field.name: getattr(p, field.name) for field in fields(model.parameters)}
        known = SimpleNamespace(**{**values, **further})
        if air is None:
            return (*model.step(base, drives, known, h), *state[width:])
        return (*_aerated_step(model, base, drives, known, h, air), *state[width:])

    def observe(state: tuple[Scalar, ...], p: Any) -> Mapping[str, Scalar]:
        return model.observe(state[:width], p)

    initials = ["".join(word[0] for word in name.split("_")) for name in names]
    return replace(
        model, name="_".join([model.name, *initials]), states=(*model.states, *states), step=step, observe=observe
    )


def _aerated_step(
    model: ProcessModel, state: tuple[Scalar, ...], drives: Any, p: Any, h: Scalar, air: Scalar
) -> tuple[Scalar, ...]:
    """Step with the bulk modulus that entrained air leaves: the mean compliance of both chambers (errata E2)."""
    place = model.index(BULK_MODULUS)
    pressure = absolute(state[model.index("differential_pressure_pa")])
    low, high = (
        effective_bulk_modulus(p.accumulator_pressure + above, state[place], air, VAPOUR_PRESSURE)
        for above in (0.0, pressure)
    )
    softened = (*state[:place], 2.0 * low * high / (low + high), *state[place + 1 :])
    moved = model.step(softened, drives, p, h)
    return (*moved[:place], state[place], *moved[place + 1 :])


def _variable(name: str) -> StateVariable:
    if name == AIR_FRACTION:
        return AIR
    healthy, unit = float(getattr(EhaParameters(), name)), notes(EhaParameters)[name].unit
    if name == "friction_linear":
        return StateVariable(name, unit, healthy, 0.0, -LARGEST_RATIO * healthy, LARGEST_RATIO * healthy)
    return StateVariable(name, unit, healthy, 0.0, healthy / LARGEST_RATIO, LARGEST_RATIO * healthy, logarithmic=True)


def augmented_prior(
    model: ProcessModel, prior: Gaussian, parameters: EhaParameters, spread: float | Mapping[str, float] = 1.5
) -> Gaussian:
    """Return the belief before the first sample of a model with further states.

    Parameters
    ----------
    model : ProcessModel
        A model of `augmented`.
    prior : Gaussian
        Belief about the states of the model before, in SI.
    parameters : EhaParameters
        First guesses; one that is 0 begins at a thousandth of the healthy value.
    spread : float or Mapping[str, float]
        Standard deviation of each further state relative to its first guess: of its logarithm, for a positive one
        [fraction].
    """
    further = model.states[len(prior.mean) :]
    means: list[float] = []
    stds: list[float] = []
    for state in further:
        guess = AIR.scale if state.name == AIR_FRACTION else float(getattr(parameters, state.name))
        held = max(guess, state.lower) if state.logarithmic else guess
        means.append(held)
        relative = spread if isinstance(spread, float | int) else spread.get(state.name, 1.5)
        stds.append(relative * max(abs(held), state.scale * 1e-3))
    covariance = np.zeros((model.width, model.width))
    n = len(prior.mean)
    covariance[:n, :n] = prior.covariance
    covariance[n:, n:] = np.diag(np.square(stds))
    return Gaussian(np.concatenate([prior.mean, means]), covariance)
