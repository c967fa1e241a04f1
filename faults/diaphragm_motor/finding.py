"""`motor_fault_finding(record, motor) -> Finding`: which fault a log of the diaphragm motor shows, and its severity."""

from collections.abc import Iterator, Sequence

from estimation.diaphragm_motor.finding import MotorCode
from estimation.diaphragm_motor.signature import DRIVE, GAIN_TOLERANCE, POSITION, Signature
from estimation.finding import Finding, Gate, Outcome, Quantity
from faults.cylinder_advice import CylinderAdviceCode
from faults.diaphragm_motor.diagnose import Match, MotorDiagnosis, diagnose_motor
from faults.diaphragm_motor.faults import HEALTHY, MOTOR_FAULTS
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import ELECTRODES, NAME
from plant.log.record import Record
from plant.notes import Code, Note

STANDSTILL_VELOCITY = 1e-4
"""Velocity below which the rod counts as standing [m/s]."""


class MotorFaultCode(Code):
    """Notes on a diagnosis of the diaphragm motor."""

    NO_FAULT_FITS = "unknown: no fault of the catalogue matches this run"
    NEAREST_MISSES = (
        "the nearest fault, {fault}, leaves a chi-square of {chi_square:.3g} for {freedom} degrees of freedom: another "
        "motor or load, or several faults; calibrate on a healthy run"
    )
    ELECTRODES_SHIFTED = (
        "the electrodes are {shift_us:.0f} us {side} the drive; without this delay the log is explained: check the "
        "electrodes' filters and where the drive is measured, or calibrate on a healthy run (--healthy)"
    )
    ROD_STANDS = "the rod moves at {velocity_mm_s:.2g} mm/s: it is stalled, or at its end stop"
    LOOKS_LIKE = "from the electrodes' fundamentals alone, it could also be {faults}"
    FAULT_FOUND = "{fault}: {severity:.3g}{unit} (95 % interval {low:.3g} to {high:.3g}{unit}), {meaning}"


class MotorAdviceCode(Code):
    """Advice on a fault of the diaphragm motor."""

    CLEAN_VALVE = "clean valve {place} and its seat; replace the valve if it still leaks"
    FREE_VALVE = "clean valve {place} and its port"
    POLARISE_DIAPHRAGM = "polarise diaphragm {place} again; replace it if its stroke stays short"
    CHECK_ELECTRODE = "check the cable and the amplifier of electrode {place}"
    BLEED_CHAMBER = "bleed chamber {place}, then find where gas gets in"
    BLEED_MOTOR = "bleed the motor, then find where gas gets in"
    CHECK_CLAMP = "check how the diaphragms are clamped"
    CHECK_LOAD = "check the load on the rod, and give it with --load"
    CLEAN_PORTS = "clean the ports, and check the oil for dirt"
    LOOK_AT_VALVES = "check the valves for dirt, and the oil for its viscosity"


def motor_fault_finding(
    record: Record, healthy: DiaphragmMotorParameters, *, calibration: Signature | None = None
) -> Finding:
    """Return the fault that a run under a steady sine shows, its severity, and the faults it cannot be told from.

    Parameters
    ----------
    record : Record
        Drive, seven electrodes, position.
    healthy : DiaphragmMotorParameters
        The motor as it should be, at the run's load.
    calibration : Signature, optional
        Signature of this motor when it was healthy, under the same drive and load.

    Returns
    -------
    Finding
        Its evidence is the `MotorDiagnosis`.

    Raises
    ------
    LogError
        If the log cannot be used, or the calibration is of another drive.
    """
    found = diagnose_motor(record, healthy, calibration=calibration)
    reasons = _objections(found)
    named = [match.name for match in found.group]
    others = [name for name in found.lookalikes if name not in named]
    nameless = found.unknown or found.best.name == HEALTHY
    return Finding(
        actuator=NAME,
        outcome=Outcome.MISMATCH if found.unknown else Outcome.OK,
        quantities={} if nameless else {found.best.name: severity_of(found.best)},
        gate=Gate(not reasons, reasons),
        channels=(DRIVE, *ELECTRODES, POSITION),
        condition=named[0],
        alike=tuple(named[1:]),
        probabilities={match.name: match.probability for match in found.matches},
        unknown=found.unknown,
        against=(MotorFaultCode.NO_FAULT_FITS.note(),) if found.unknown else (),
        faults=tuple(_fault_note(match) for match in found.group if match.name != HEALTHY and not found.unknown),
        advice=() if found.unknown else tuple(_remedy(match) for match in found.group if match.name != HEALTHY),
        not_told=() if found.unknown else tuple(_not_told(others, calibrated=calibration is not None)),
        evidence=found,
    )


def severity_of(match: Match) -> Quantity:
    """Return the severity of a fault.

    Parameters
    ----------
    match : Match
        The nearest point of the fault's curve; not that of a healthy motor.

    Returns
    -------
    Quantity
        Its severity, in the fault's unit.
    """
    return Quantity.normal(match.severity, match.deviation, MOTOR_FAULTS[match.name].unit)


def _objections(found: MotorDiagnosis) -> tuple[Note, ...]:
    reasons: list[Note] = []
    if found.unknown:
        best = found.best
        reasons.append(
            MotorFaultCode.NEAREST_MISSES.note(
                fault=best.name.replace("_", " "), chi_square=best.chi_square, freedom=found.freedom
            )
        )
    if found.delay is not None:
        reasons.append(
            MotorFaultCode.ELECTRODES_SHIFTED.note(
                shift_us=1e6 * abs(found.delay), side="behind" if found.delay > 0.0 else "ahead of"
            )
        )
    if abs(found.signature.velocity) < STANDSTILL_VELOCITY:
        reasons.append(MotorFaultCode.ROD_STANDS.note(velocity_mm_s=1e3 * found.signature.velocity))
    return tuple(reasons)


def _not_told(lookalikes: Sequence[str], *, calibrated: bool) -> Iterator[Note]:
    if lookalikes:
        yield MotorFaultCode.LOOKS_LIKE.note(faults=" or ".join(lookalikes).replace("_", " "))
    if not calibrated:
        yield MotorCode.AS_DESIGNED.note(percent=100.0 * GAIN_TOLERANCE)


def _remedy(match: Match) -> Note:
    fault = MOTOR_FAULTS[match.name]
    match fault.kind:
        case "valve_leak":
            return MotorAdviceCode.CLEAN_VALVE.note(place=fault.place)
        case "valve_blocked":
            return MotorAdviceCode.FREE_VALVE.note(place=fault.place)
        case "depolarised":
            return MotorAdviceCode.POLARISE_DIAPHRAGM.note(place=fault.place)
        case "gain":
            return MotorAdviceCode.CHECK_ELECTRODE.note(place=fault.place)
        case "gas":
            return MotorAdviceCode.BLEED_CHAMBER.note(place=fault.place)
        case "gas_everywhere":
            return MotorAdviceCode.BLEED_MOTOR.note()
        case "soft_clamp":
            return MotorAdviceCode.CHECK_CLAMP.note()
        case "cylinder_leakage":
            return CylinderAdviceCode.LOOK_AT_PISTON_SEAL.note()
        case "friction":
            return CylinderAdviceCode.LOOK_AT_ROD.note()
        case "load":
            return MotorAdviceCode.CHECK_LOAD.note()
        case "clogged_ports":
            return MotorAdviceCode.CLEAN_PORTS.note()
        case _:
            return MotorAdviceCode.LOOK_AT_VALVES.note()


def _fault_note(match: Match) -> Note:
    fault = MOTOR_FAULTS[match.name]
    scale = 100.0 if fault.unit == "1" else 1.0
    low, high = (scale * end for end in match.interval)
    return MotorFaultCode.FAULT_FOUND.note(
        fault=match.name.replace("_", " "),
        meaning=fault.meaning,
        severity=scale * match.severity,
        low=low,
        high=high,
        unit=" %" if fault.unit == "1" else f" {fault.unit}",
    )
