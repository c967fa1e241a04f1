"""The flow form with what matters to the last digits alone: make-up valves that crack, and an accumulator."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from estimation.models.flow import FLOW_FORM, MASS_FLOW_FORM, STIFFNESS, all_at_rest, fed_rates
from estimation.models.greybox import GreyBoxModel
from estimation.models.inner_circuit import BEND, USUAL_BEND
from plant.compiled.functions import Scalar

CRACKS = ("crack_a", "crack_b")
"""Drops at which the two make-up valves leave their seats [Pa]."""

USUAL_CRACK = 2e3
"""Their standard deviation before a log is seen, and typical size: 0.02 bar, judged [Pa]. A drop of 2 kPa that is left
out puts bulk modulus of leaky actuators up to 0.3 % off at 10 kHz."""


def completed(form: GreyBoxModel, *, bent: bool = False) -> GreyBoxModel:
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
        form = replace(form, name="flow_volume", initial=all_at_rest, rates=_by_volume, jump=MASS_FLOW_FORM.jump)
        names = (*names, STIFFNESS)
        form = replace(form, rates=_bent_by_volume) if bent else form
    elif bent:
        form = replace(form, rates=_bent_by_mass)
    return replace(form, unknowns=(*form.unknowns, *names), linear=(*form.linear, *sizes))


def balances_mass(form: GreyBoxModel) -> bool:
    """Return whether a form, completed or not, balances mass."""
    return form.rates in (MASS_FLOW_FORM.rates, _bent_by_mass)


def _by_volume(
    state: tuple[Scalar, Scalar, Scalar], drives: Any, p: SimpleNamespace, share: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    return fed_rates(state, drives, p, share, by_mass=False)


def _bent_by_volume(
    state: tuple[Scalar, Scalar, Scalar], drives: Any, p: SimpleNamespace, share: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    return fed_rates(state, drives, p, share, by_mass=False, bend=p.makeup_bend)


def _bent_by_mass(
    state: tuple[Scalar, Scalar, Scalar], drives: Any, p: SimpleNamespace, share: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    return fed_rates(state, drives, p, share, by_mass=True, bend=p.makeup_bend)
