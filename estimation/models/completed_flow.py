"""The flow form with what matters to the last digits alone: make-up valves that crack, and an accumulator."""

from dataclasses import replace
from functools import partial

from estimation.models.flow import FLOW_FORM, MASS_FLOW_FORM, STIFFNESS, all_at_rest, fed_rates
from estimation.models.greybox import GreyBoxModel
from estimation.models.inner_circuit import BEND, USUAL_BEND

CRACKS = ("crack_a", "crack_b")
"""Drops at which the two make-up valves leave their seats [Pa]."""

USUAL_CRACK = 2e3
"""Their standard deviation before a log is seen, and typical size: 0.02 bar, judged [Pa]. A drop of 2 kPa that is left
out puts bulk modulus of leaky actuators up to 0.3 % off at 10 kHz."""


BY_VOLUME = partial(fed_rates, by_mass=False)
BENT_BY_VOLUME = partial(fed_rates, by_mass=False, bent=True)
BENT_BY_MASS = partial(fed_rates, by_mass=True, bent=True)
"""Rates with an accumulator; what is bent has orifices for make-up valves."""


def completed_flow_form(form: GreyBoxModel, *, bent: bool = False) -> GreyBoxModel:
    """Return a form with make-up valves that leave their seats each at its own drop, and with an accumulator.

    Parameters
    ----------
    form : GreyBoxModel
        One of `estimation.models.flow` whose volumes swing.
    bent : bool
        Whether the valves are orifices at a large drop, which costs a root of each in each step.
    """
    sizes, names = tuple((name, USUAL_CRACK) for name in CRACKS), CRACKS
    if bent:
        sizes, names = (*sizes, (BEND, USUAL_BEND)), (*names, BEND)
    if form.rates is FLOW_FORM.rates:
        form = replace(form, name="flow_volume", initial=all_at_rest, rates=BY_VOLUME, jump=MASS_FLOW_FORM.jump)
        names = (*names, STIFFNESS)
        form = replace(form, rates=BENT_BY_VOLUME) if bent else form
    elif bent:
        form = replace(form, rates=BENT_BY_MASS)
    return replace(form, unknowns=(*form.unknowns, *names), linear=(*form.linear, *sizes))


def balances_mass(form: GreyBoxModel) -> bool:
    """Return whether a form, completed or not, balances mass."""
    return form.rates in (MASS_FLOW_FORM.rates, BENT_BY_MASS)
