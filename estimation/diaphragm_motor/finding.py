"""`motor_finding(record, motor) -> Finding`: leakage, load and gas of the diaphragm motor, and what a log lacks."""

from collections.abc import Mapping

from estimation.diaphragm_motor.card import LEAKAGE, LOAD, MOST_LEAKAGE, flow_change, motor_card
from estimation.diaphragm_motor.estimate import MotorEstimate, estimate_motor
from estimation.diaphragm_motor.signature import GAIN_TOLERANCE, Signature
from estimation.finding import Finding, Gate, Outcome, Quantity
from estimation.trust.card import percent
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import NAME
from plant.log.record import Record
from plant.notes import Code, Note

MOST_DEVIATION = 0.3
"""Standard deviation, over the value or over the size of a small fault, above which no number is given."""

SIZES: Mapping[str, tuple[str, float]] = {
    "crossport_leakage": ("m^3/(s Pa)", LEAKAGE),
    "load_force": ("N", 10.0),
    "gas_fraction": ("1", 0.01),
}
"""Unit of each quantity, and the size of a small fault to which its deviation is compared."""

CLEARLY_NEGATIVE_DEVIATIONS = 4.0
"""Standard deviations of a negative leakage from which the maps are rejected."""


class MotorCode(Code):
    """Notes on an estimate of the diaphragm motor."""

    PATTERN_BROKEN = (
        "the electrode pattern is not that of a healthy pump (chi-square {chi_square:.3g} per degree of freedom), so "
        "the maps of flow and pressure do not hold: run diagnose first"
    )
    FASTER_THAN_MAPS = (
        "the rod moves faster than the pump's maps allow (leakage {leakage:.2g|L/(min bar)} L/(min bar)): ports may be "
        "clogged"
    )
    ROD_BACKWARDS = (
        "the rod moves against the pump's flow, faster than any leak explains (leakage {leakage:.2g|L/(min bar)} "
        "L/(min bar)): position_m has the opposite sign, or the valve retracts (spool = -1 in the rig file)"
    )
    AS_DESIGNED = (
        "without a healthy run (--healthy) the intervals assume that gains, drive and motor agree with the rig file to "
        "{percent:.2g} %"
    )
    TOO_UNCERTAIN = (
        "too uncertain for a value: {names}; apply a load of 10 N or more, or give a healthy run (--healthy)"
    )
    LOAD_AND_FRICTION = "the load includes any friction above the model's"
    PISTON_LEAKS = "the piston leaks; this is certain from {since_s:.2f} s on"
    BULK_MODULUS_HIDDEN = (
        "bulk modulus is not observable here (Cramér-Rao bound {bound} of its value): halving it changes the flow by "
        "{halved}, doubling it by {doubled}, because the diaphragms yield 400 times as much as the oil"
    )


def motor_finding(
    record: Record, healthy: DiaphragmMotorParameters, *, calibration: Signature | None = None
) -> Finding:
    """Estimate leakage across the piston, load and gas from a run under a steady sine.

    Parameters
    ----------
    record : Record
        Drive, seven electrodes, position.
    healthy : DiaphragmMotorParameters
        The healthy motor; at the calibration's load, if there is one.
    calibration : Signature, optional
        Signature of this motor when it was healthy, under the same drive.

    Returns
    -------
    Finding
        Its evidence is the `MotorEstimate`.

    Raises
    ------
    LogError
        If the log cannot be used.
    """
    found = estimate_motor(record, healthy, calibration=calibration)
    reasons = _pattern_notes(found, healthy)
    quantities = {name: _quantity(name, found, told=not reasons) for name in SIZES}
    lost = [name for name, one in quantities.items() if one.value is None]
    believed = healthy if reasons else found.parameters
    card = motor_card(believed, found.drive.frequency, found.drive.peak_to_peak)
    bound = card.relative_std["bulk_modulus"]
    alarm = None if reasons else found.track.alarm_time
    not_told: list[Note] = []
    if lost and not reasons:
        not_told.append(MotorCode.TOO_UNCERTAIN.note(names=", ".join(name.replace("_", " ") for name in lost)))
    if quantities["load_force"].value is not None:
        not_told.append(MotorCode.LOAD_AND_FRICTION.note())
    if calibration is None and not reasons:
        not_told.append(MotorCode.AS_DESIGNED.note(percent=100.0 * GAIN_TOLERANCE))
    told = Outcome.NOT_OBSERVABLE if len(lost) == len(SIZES) else Outcome.OK
    return Finding(
        actuator=NAME,
        outcome=Outcome.MISMATCH if reasons else told,
        quantities={**quantities, "bulk_modulus": Quantity(None, "Pa", None, bound * healthy.bulk_modulus)},
        gate=Gate(not reasons, reasons),
        channels=card.channels,
        faults=() if alarm is None else (MotorCode.PISTON_LEAKS.note(since_s=alarm),),
        not_told=(*not_told, _bulk_modulus(believed, found, bound)),
        evidence=found,
    )


def motor_prospect(motor: DiaphragmMotorParameters, frequency: float, peak_to_peak: float) -> Finding:
    """Return what a run under a steady sine would determine, before it is made (`estimation.diaphragm_motor.card`).

    Parameters
    ----------
    motor : DiaphragmMotorParameters
        The motor, under its load.
    frequency, peak_to_peak : float
        Frequency and swing of the drive [Hz], [V].

    Returns
    -------
    Finding
        The motor's own values with the least standard deviations that any method could reach.
    """
    card = motor_card(motor, frequency, peak_to_peak)
    gas = sum(motor.gas_fraction) / len(motor.gas_fraction)
    std = card.relative_std
    quantities = {
        "bulk_modulus": Quantity(motor.bulk_modulus, "Pa", None, std["bulk_modulus"] * motor.bulk_modulus),
        "gas_fraction": Quantity(gas, "1", None, std["gas_fraction"] * gas),
        "crossport_leakage": Quantity(motor.crossport_leakage, "m^3/(s Pa)", None, std["crossport_leakage"] * LEAKAGE),
        "load_force": Quantity(motor.load_force, "N", None, std["load_force"] * LOAD),
    }
    return Finding(NAME, Outcome.OK, quantities, Gate(True, ()), card.channels, evidence=card)


def _pattern_notes(found: MotorEstimate, healthy: DiaphragmMotorParameters) -> tuple[Note, ...]:
    leakage, deviation = (one["crossport_leakage"] for one in (found.values, found.deviations))
    if not found.pattern_holds:
        return (MotorCode.PATTERN_BROKEN.note(chi_square=found.pattern),)
    if found.velocity * healthy.spool < 0.0 and leakage > MOST_LEAKAGE:
        return (MotorCode.ROD_BACKWARDS.note(leakage=leakage),)
    if leakage < -CLEARLY_NEGATIVE_DEVIATIONS * deviation:
        return (MotorCode.FASTER_THAN_MAPS.note(leakage=leakage),)
    return ()


def _quantity(name: str, found: MotorEstimate, *, told: bool) -> Quantity:
    unit, size = SIZES[name]
    value, deviation = found.values[name], found.deviations[name]
    if told and deviation < MOST_DEVIATION * max(size, abs(value)):
        return Quantity.normal(value, deviation, unit)
    return Quantity(None, unit, None, deviation)


def _bulk_modulus(motor: DiaphragmMotorParameters, found: MotorEstimate, bound: float) -> Note:
    drive = found.drive.frequency, found.drive.peak_to_peak
    halved, doubled = (percent(abs(flow_change(motor, *drive, factor))) for factor in (0.5, 2.0))
    return MotorCode.BULK_MODULUS_HIDDEN.note(bound=percent(bound), halved=halved, doubled=doubled)
