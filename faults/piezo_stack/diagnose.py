"""From a piezo-stack log to a class: the nine conditions, and every other fault by name and size."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import log

from estimation.finding import Finding, Gate, Outcome
from estimation.piezo_stack.estimate import StackEstimate, estimate_stack
from estimation.piezo_stack.finding import channel_disagrees, estimate_in_step, stack_quantities, undescribed_channels
from estimation.piezo_stack.runs import STACK_CHANNELS
from estimation.piezo_stack.unknowns import DEFAULT_UNKNOWNS, STARTS
from faults.conditions import CONDITIONS
from faults.cylinder_advice import CylinderAdviceCode
from faults.piezo_stack.faults import ADDED_FRICTION, CROSSPORT_LEAKAGE
from plant.log.record import Record
from plant.notes import Code, Note
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.trajectory import NAME

GAPS = ("outlet_reed_gap", "inlet_reed_gap")

SELDOM_UNKNOWNS: tuple[tuple[tuple[str, ...], tuple[Mapping[str, float], ...]], ...] = (
    (GAPS, ({}, *({name: gap} for gap in (0.3, 1.5) for name in GAPS))),
    (("bias_pressure",), tuple({"bias_pressure": log(share)} for share in (0.8, 0.6, 0.4, 1.5))),
)
"""Unknowns that are tried in turn if all others leave a misfit, with first guesses as in
`estimation.piezo_stack.unknowns.STARTS`."""

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
"""Quantities that a healthy run calibrates: with leaks known to be absent, friction can be told from lines and
reeds."""

SURE = 3.0
"""Standard deviations by which a quantity must differ from its healthy value before a fault is named (judged)."""

MORE_AIR = 0.3
"""Rise of the entrained air from which it counts as a fault [fraction of the healthy share] (judged)."""

LEAST_CHAMBER_LEAKAGE = 1e-12
"""Leakage of the pump chamber from which it counts as a fault [m^3/(s Pa)] (judged)."""

LEAST_DEPOLARISED = 0.05
"""Lost stroke of the stack from which it counts as a fault [fraction] (judged)."""

REED_CHANGED = 0.2
"""Change of a reed's stiffness from which it counts as a fault [fraction] (judged)."""

LEAST_GAP = 5e-6
"""Gap below a reed from which it counts as a fault [m] (judged)."""

BIAS_CHANGED = 0.05
"""Change of the bias pressure from which it counts as a fault [fraction] (judged)."""


class StackFaultCode(Code):
    """Notes on a diagnosis of the piezo-stack actuator."""

    ANOTHER_ACTUATOR = (
        "the model misses {channel} by {ratio:.3g} times its noise: the actuator or its load is not as the rig file "
        "says; calibrate on a healthy run (--healthy)"
    )
    LEAKAGE_AND_FRICTION = "these sensors cannot separate leakage from friction: log the stack's displacement"
    AIR_IN_OIL = "air in the oil: {percent:.2f} %, {ratio:.3g} times the healthy share"
    CHAMBER_LEAKS = "the pump chamber leaks: {leakage:.2g|L/(min bar)} L/(min bar)"
    STACK_DEPOLARISED = "the stack is depolarised: {percent:.0f} % of its stroke is lost"
    STROKE_LARGE = "the stack moves {percent:.0f} % more than the rig file says"
    REED_SOFT = "{reed} reed soft: {ratio:.3g} times the healthy stiffness"
    REED_STIFF = "{reed} reed stiff or jammed: {ratio:.3g} times the healthy stiffness"
    REED_OPEN = "{reed} reed does not shut: a gap of {gap_um:.0f} um"
    BIAS_OFF = "bias pressure {found_mpa:.3g} MPa where the rig file says {wanted_mpa:.3g} MPa"


class StackAdviceCode(Code):
    """Advice on a fault of the piezo-stack actuator."""

    BLEED_OIL = "bleed the oil, then find where air gets in"
    LOOK_AT_CHAMBER = "inspect the joints and the membrane of the pump chamber"
    POLARISE = "polarise the stack again; replace it if the stroke stays short"
    CHECK_SCALE = (
        "check the scale of the drive voltage, then the stroke in the rig file; calibrate on a healthy run (--healthy)"
    )
    REPLACE_REED = "inspect the {reed} reed for a crack, and replace it"
    FREE_REED = "clean the {reed} reed and its stop"
    CLEAN_SEAT = "clean the seat of the {reed} reed; replace the reed if the gap stays"
    SET_BIAS = "set the bias pressure, then check the accumulator; give --bias-pressure if it was meant"


def diagnose_stack(
    record: Record, healthy: PiezoStackParameters, *, channels: tuple[str, ...] = STACK_CHANNELS
) -> Finding:
    """Return which of the nine conditions a run shows, and its other faults.

    Parameters
    ----------
    record : Record
        A run that began at rest.
    healthy : PiezoStackParameters
        The actuator as it should be, at the run's bias pressure and load.

    Returns
    -------
    Finding
        Condition, other faults, and the objections to them; its evidence is the `StackEstimate`.

    Raises
    ------
    LogError
        If the log cannot be used.
    """
    found, in_step, shifts = estimate_in_step(record, healthy, channels=channels)
    for seldom, guesses in SELDOM_UNKNOWNS:
        if undescribed_channels(found):
            unknowns, starts = (*DEFAULT_UNKNOWNS, *seldom), (*STARTS, *guesses)
            wider = estimate_stack(in_step, healthy, unknowns=unknowns, channels=channels, starts=starts)
            found = min(found, wider, key=lambda one: max(one.misfit.values()))
    against = tuple(
        StackFaultCode.ANOTHER_ACTUATOR.note(channel=name, ratio=ratio)
        for name, ratio in undescribed_channels(found).items()
    )
    if against:
        against += channel_disagrees(in_step, healthy, tuple(found.misfit))
    leakage = _level(found, "crossport_leakage", healthy.crossport_leakage, CROSSPORT_LEAKAGE)
    friction = _level(found, "coulomb_friction", healthy.coulomb_friction, ADDED_FRICTION)
    condition = next((n for n, c in CONDITIONS.items() if (c.leakage, c.friction) == (leakage, friction)), None)
    reasons = against if condition is not None else (*against, StackFaultCode.LEAKAGE_AND_FRICTION.note())
    told = Outcome.NOT_OBSERVABLE if condition is None else Outcome.OK
    faults = () if reasons else tuple(n for n in (_fault_note(name, found, healthy) for name in found.values) if n)
    return Finding(
        actuator=NAME,
        outcome=Outcome.MISMATCH if against else told,
        quantities=stack_quantities(found, healthy),
        gate=Gate(not reasons, reasons),
        channels=tuple(found.misfit),
        condition=condition,
        unknown=bool(against),
        against=against,
        faults=faults,
        advice=() if reasons or condition is None else (*_advice(condition), *map(_remedy, faults)),
        notes=shifts,
        evidence=found,
    )


def _advice(condition: str) -> Iterator[Note]:
    if CONDITIONS[condition].leakage != "none":
        yield CylinderAdviceCode.LOOK_AT_PISTON_SEAL.note()
    if CONDITIONS[condition].friction != "none":
        yield CylinderAdviceCode.LOOK_AT_ROD.note()


def _remedy(fault: Note) -> Note:
    match fault.code:
        case StackFaultCode.AIR_IN_OIL:
            return StackAdviceCode.BLEED_OIL.note()
        case StackFaultCode.CHAMBER_LEAKS:
            return StackAdviceCode.LOOK_AT_CHAMBER.note()
        case StackFaultCode.STACK_DEPOLARISED:
            return StackAdviceCode.POLARISE.note()
        case StackFaultCode.STROKE_LARGE:
            return StackAdviceCode.CHECK_SCALE.note()
        case StackFaultCode.REED_SOFT:
            return StackAdviceCode.REPLACE_REED.note(reed=fault.data["reed"])
        case StackFaultCode.REED_STIFF:
            return StackAdviceCode.FREE_REED.note(reed=fault.data["reed"])
        case StackFaultCode.REED_OPEN:
            return StackAdviceCode.CLEAN_SEAT.note(reed=fault.data["reed"])
        case _:
            return StackAdviceCode.SET_BIAS.note()


def _level(found: StackEstimate, name: str, healthy: float, levels: Mapping[str, float]) -> str | None:
    """Return the nearest level; None if two standard deviations exceed half the smallest step between levels."""
    if 2.0 * found.deviations[name] > 0.5 * levels["minor"]:
        return None
    above = found.values[name] - healthy
    return min(levels, key=lambda level: abs(above - levels[level]))


def _fault_note(name: str, found: StackEstimate, healthy: PiezoStackParameters) -> Note | None:
    """Return the fault that a quantity shows; None if there is none, or it is uncertain."""
    value, sure = found.values[name], SURE * found.deviations[name]
    base = 1.0 if name == "polarisation" else float(getattr(healthy, name))
    reed, _, part = name.partition("_reed_")
    if name == "air_fraction" and value - base > max(MORE_AIR * base, sure):
        return StackFaultCode.AIR_IN_OIL.note(percent=100.0 * value, ratio=value / base)
    if name == "chamber_leakage" and value - base > max(LEAST_CHAMBER_LEAKAGE, sure):
        return StackFaultCode.CHAMBER_LEAKS.note(leakage=value)
    if name == "polarisation" and base - value > max(LEAST_DEPOLARISED, sure):
        return StackFaultCode.STACK_DEPOLARISED.note(percent=100.0 * (1.0 - value))
    if name == "polarisation" and value - base > max(LEAST_DEPOLARISED, sure):
        return StackFaultCode.STROKE_LARGE.note(percent=100.0 * (value - 1.0))
    if part == "stiffness" and abs(value - base) > max(REED_CHANGED * base, sure):
        code = StackFaultCode.REED_SOFT if value < base else StackFaultCode.REED_STIFF
        return code.note(reed=reed, ratio=value / base)
    if part == "gap" and value - base > max(LEAST_GAP, sure):
        return StackFaultCode.REED_OPEN.note(reed=reed, gap_um=1e6 * value)
    if name == "bias_pressure" and abs(value - base) > max(BIAS_CHANGED * base, sure):
        return StackFaultCode.BIAS_OFF.note(found_mpa=1e-6 * value, wanted_mpa=1e-6 * base)
    return None


def calibrated_stack(record: Record, nominal: PiezoStackParameters) -> PiezoStackParameters:
    """Return the actuator that a healthy run shows: the nominal one with `CALIBRATED` fitted.

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
    found, *_ = estimate_in_step(record, nominal, unknowns=CALIBRATED, starts=({},))
    changed = [name for name in vars(found.parameters) if getattr(found.parameters, name) != getattr(nominal, name)]
    return replace(nominal, **{name: getattr(found.parameters, name) for name in changed})
