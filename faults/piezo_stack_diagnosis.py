"""From what a piezo-stack log says to a class: the nine conditions, and every other fault by name and size."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from estimation.piezo_stack import StackEstimate, estimate_stack
from estimation.piezo_stack_runs import STACK_CHANNELS
from estimation.piezo_stack_unknowns import DEFAULT_UNKNOWNS, STARTS
from faults.conditions import CONDITIONS
from faults.piezo_stack import ADDED_FRICTION, CROSSPORT_LEAKAGE
from plant.piezo_stack_parameters import PiezoStackParameters
from plant.record import Record

MOST_MISFIT = 1.1
"""Residual over noise above which the model does not describe a log; with 1000 samples chance leaves 1.05 at most."""

GAPS = ("outlet_reed_gap", "inlet_reed_gap")
"""Unknowns that are tried where the others leave a misfit."""

GAP_STARTS: tuple[Mapping[str, float], ...] = (
    {},
    {"outlet_reed_gap": 0.3},
    {"inlet_reed_gap": 0.3},
    {"outlet_reed_gap": 1.5},
    {"inlet_reed_gap": 1.5},
)
"""First guesses for them, scaled as `estimation.piezo_stack.UNKNOWNS`."""

CALIBRATED = (
    "air_fraction",
    "coulomb_friction",
    "polarisation",
    "outlet_reed_stiffness",
    "inlet_reed_stiffness",
    "viscous_friction",
    "delivery_length",
    "discharge_coefficient",
)
"""What a healthy run calibrates: with leaks known to be none, friction is told from lines and reeds."""


@dataclass(frozen=True)
class StackDiagnosis:
    """What is wrong with the actuator.

    Parameters
    ----------
    condition : str or None
        Which of the nine conditions; None where the log cannot tell.
    findings : tuple of str
        Other faults, with their size, in words.
    reasons : tuple of str
        Why not to rely on it; empty where nothing speaks against it.
    estimate : StackEstimate
        The quantities behind it.
    """

    condition: str | None
    findings: tuple[str, ...]
    reasons: tuple[str, ...]
    estimate: StackEstimate


def diagnose_stack(
    record: Record, healthy: PiezoStackParameters, *, channels: tuple[str, ...] = STACK_CHANNELS
) -> StackDiagnosis:
    """Say which of the nine conditions a run shows, and what else is wrong.

    Parameters
    ----------
    record : Record
        A run that began at rest.
    healthy : PiezoStackParameters
        The actuator as it should be, at the run's bias pressure and load.
    channels : tuple of str
        What is used of what is logged.

    Returns
    -------
    StackDiagnosis
        Condition, findings, and what speaks against them.

    Raises
    ------
    LogError
        If the log cannot be used.
    """
    found = estimate_stack(record, healthy, channels=channels)
    if max(found.misfit.values()) > MOST_MISFIT:
        wider = estimate_stack(
            record,
            healthy,
            unknowns=(*DEFAULT_UNKNOWNS, *GAPS),
            channels=channels,
            starts=(*STARTS, *GAP_STARTS),
        )
        if _worst(wider) < _worst(found):
            found = wider
    reasons = [
        f"{name} is missed by {misfit:.3g} times its noise: this is another actuator, calibrate on a healthy run"
        for name, misfit in found.misfit.items()
        if misfit > MOST_MISFIT
    ]
    leakage = _level(found, "crossport_leakage", healthy.crossport_leakage, CROSSPORT_LEAKAGE)
    friction = _level(found, "coulomb_friction", healthy.coulomb_friction, ADDED_FRICTION)
    if leakage is None or friction is None:
        reasons.append("the sensors hold too little to tell leakage from friction: log the stack's displacement")
    condition = next((n for n, c in CONDITIONS.items() if (c.leakage, c.friction) == (leakage, friction)), None)
    findings = [words for name in found.values for words in _finding(name, found, healthy)]
    return StackDiagnosis(condition, tuple(findings), tuple(reasons), found)


def _worst(found: StackEstimate) -> float:
    return max(found.misfit.values())


def _level(found: StackEstimate, name: str, healthy: float, levels: Mapping[str, float]) -> str | None:
    """Return the nearest level, None where two standard deviations span half the least step between levels."""
    if 2.0 * found.deviations[name] > 0.5 * levels["minor"]:
        return None
    above = found.values[name] - healthy
    return min(levels, key=lambda level: abs(above - levels[level]))


def _finding(name: str, found: StackEstimate, healthy: PiezoStackParameters) -> list[str]:
    if name not in _THRESHOLDS:
        return []
    says, words = _THRESHOLDS[name]
    value, deviation = found.values[name], found.deviations[name]
    base = 1.0 if name == "polarisation" else float(getattr(healthy, name))
    return [words(value, base)] if says(value, base, 3.0 * deviation) else []


def _stiffness(reed: str) -> tuple[Callable[[float, float, float], bool], Callable[[float, float], str]]:
    return (
        lambda value, base, sure: abs(value - base) > max(0.2 * base, sure),
        lambda value, base: f"{reed} reed {'soft' if value < base else 'stiff or jammed'}: {value / base:.3g} times",
    )


def _gap(reed: str) -> tuple[Callable[[float, float, float], bool], Callable[[float, float], str]]:
    return (
        lambda value, base, sure: value - base > max(5e-6, sure),
        lambda value, _: f"{reed} reed does not shut: a gap of {1e6 * value:.0f} um",
    )


_THRESHOLDS: Mapping[str, tuple[Callable[[float, float, float], bool], Callable[[float, float], str]]] = (
    MappingProxyType(
        {
            "air_fraction": (
                lambda value, base, sure: value - base > max(0.3 * base, sure),
                lambda value, base: (
                    f"air in the oil: {100.0 * value:.2f} %, {value / base:.3g} times the healthy share"
                ),
            ),
            "chamber_leakage": (
                lambda value, base, sure: value - base > max(1e-12, sure),
                lambda value, _: f"the pump chamber leaks: {value:.2g} m^3/(s Pa)",
            ),
            "polarisation": (
                lambda value, base, sure: base - value > max(0.05, sure),
                lambda value, _: f"the stack is depolarised: {100.0 * (1.0 - value):.0f} % of its stroke is lost",
            ),
            "outlet_reed_stiffness": _stiffness("outlet"),
            "inlet_reed_stiffness": _stiffness("inlet"),
            "outlet_reed_gap": _gap("outlet"),
            "inlet_reed_gap": _gap("inlet"),
        }
    )
)


def calibrated_stack(record: Record, nominal: PiezoStackParameters) -> PiezoStackParameters:
    """Return the actuator as a healthy run shows it: the nominal one with `CALIBRATED` fitted.

    Parameters
    ----------
    record : Record
        A run of the healthy actuator that began at rest.
    nominal : PiezoStackParameters
        The actuator as designed, at the run's bias pressure and load.

    Returns
    -------
    PiezoStackParameters
        The actuator to compare later runs with.

    Raises
    ------
    LogError
        If the log cannot be used.
    RigError
        If what fits is no actuator.
    """
    found = estimate_stack(record, nominal, unknowns=CALIBRATED, starts=({},))
    changed = [name for name in vars(found.parameters) if getattr(found.parameters, name) != getattr(nominal, name)]
    return replace(nominal, **{name: getattr(found.parameters, name) for name in changed})
