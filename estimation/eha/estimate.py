"""`estimate_log(record, rig) -> Finding`: bulk modulus and leakage from a log of the gear-pump actuator."""

from estimation.eha.bulk_modulus import DEFAULT_OPTIONS, FITTED, EstimateOptions, estimate_clean, left_out_notes
from estimation.eha.explanation_notes import notes_of
from estimation.eha.result import BulkModulusEstimate
from estimation.eha.rig_share import another_oil_notes
from estimation.finding import Finding, Outcome, Quantity
from estimation.log_checks.channel_names import PRESSURE
from estimation.log_checks.clean import CleanLog, clean_log
from estimation.notes import EstimateCode, RigCode
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.log.record import Record
from plant.notes import Note
from plant.units import notes as parameter_notes

KIND = "eha"
"""Name of the gear-pump actuator in the registry."""

BULK_MODULUS_REASONS = {
    EstimateCode.BOUND_TOO_WIDE,
    EstimateCode.PRESSURE_RESIDUALS_SMALL,
    EstimateCode.POSITION_RESIDUALS_LARGE,
    EstimateCode.FRICTION_LAWS_DISAGREE,
    EstimateCode.FORCES_ON_ANY_SCALE,
    EstimateCode.WEAKLY_HELD,
    EstimateCode.NOT_HELD,
}
"""Reasons of a gate against bulk modulus alone: the log has too little information on it, its oil is too stiff for the
position noise, or it depends on how the piston starts and stops. They are no reasons against a condition."""

LARGEST_SHARE = 0.06
"""Largest share of the motion that a fit without pressure may leave before nothing is concluded from the log
[fraction]: as much as means over 0.1 s may differ from a circuit's (`faults.diagnosis.circuits.out_of_model`)."""

UNDETERMINED_REMARKS = frozenset({RigCode.MAKEUP_UNSEEN})
"""Remarks of a fit on what a log does not determine, which say nothing about its numbers."""


def estimate_log(record: Record, rig: Rig, options: EstimateOptions = DEFAULT_OPTIONS) -> Finding:
    """Estimate effective bulk modulus, and further parameters, from a log.

    Parameters
    ----------
    record : Record
        The log.
    rig : Rig
        The actuator: parameters, and how well they are known.
    options : EstimateOptions
        Options of the estimate; all automatic if not given.

    Returns
    -------
    Finding
        Quantities, gate and notes; its evidence is the `BulkModulusEstimate`.

    Raises
    ------
    HydrostateError
        If an option is unknown or not usable.
    LogError
        If the log lacks what the form needs.
    """
    return finding_of(*checked_estimate(clean_log(record, rig.parameters), rig, options), rig)


def checked_estimate(log: CleanLog, rig: Rig, options: EstimateOptions) -> tuple[CleanLog, BulkModulusEstimate]:
    """Return a log, after its checks, with its estimate."""
    return log, estimate_clean(log, rig.parameters, options, rig.spreads)


def finding_of(log: CleanLog, found: BulkModulusEstimate, rig: Rig) -> Finding:
    """Return an estimate as a finding."""
    return Finding(
        actuator=KIND,
        outcome=found.outcome,
        quantities={"bulk_modulus": found.quantity, **_other_quantities(found)},
        gate=found.gate,
        channels=found.channels,
        notes=(
            *left_out_notes(log, found),
            *missing_pressure_notes(found),
            *explanation_and_remarks(found, rig.parameters),
            *another_oil_notes(found.value if found.gate.passed else None, rig.parameters),
            *found.rig_notes,
        ),
        not_told=tuple(note for note in found.remarks if note.code in UNDETERMINED_REMARKS),
        evidence=found,
    )


def _other_quantities(found: BulkModulusEstimate) -> dict[str, Quantity]:
    units = {name: note.unit for name, note in parameter_notes(EhaParameters).items()}
    return {
        name: found.with_total(name, Quantity.normal(value, std, units.get(name, "1")))
        for name, (value, std) in found.others.items()
    }


def explanation_and_remarks(found: BulkModulusEstimate, parameters: EhaParameters) -> tuple[Note, ...]:
    """Return the notes on the explanation of a log by rig, oil or logger, and the remarks of its fit.

    Parameters
    ----------
    parameters : EhaParameters
        The actuator, as its rig file has it.

    Returns
    -------
    tuple of Note
        Empty for a plain log.
    """
    strange = () if found.explanation is None else notes_of(found.explanation, parameters)
    return (*strange, *(note for note in found.remarks if note.code not in UNDETERMINED_REMARKS))


def missing_pressure_notes(found: BulkModulusEstimate) -> tuple[Note, ...]:
    """Return the note on what is lost without differential pressure; empty if it is used.

    Returns
    -------
    tuple of Note
        One at most.
    """
    if PRESSURE in found.channels:
        return ()
    if found.form == "acceleration":
        return (EstimateCode.PRESSURE_UNUSED.note(),)
    return (EstimateCode.PRESSURE_ABSENT.note(),)


def rejection_notes(found: BulkModulusEstimate) -> tuple[Note, ...]:
    """Return why the fit of a log is rejected, so that nothing can be concluded from it.

    A form with given leakage and friction may be rejected because the actuator has others; that is no objection to the
    log.

    Returns
    -------
    tuple of Note
        Reasons of its gate; empty if it passed, or if they concern bulk modulus alone. If the model leaves much of the
        motion, all reasons count, however fine the encoder.
    """
    if found.form not in FITTED:
        return ()
    spared = {EstimateCode.BOUND_TOO_WIDE} if _is_motion_wrong(found) else BULK_MODULUS_REASONS
    return tuple(note for note in found.gate.reasons if note.code not in spared)


def _is_motion_wrong(found: BulkModulusEstimate) -> bool:
    """Return whether the residual is a large share of the piston's motion, and not only large beside the noise."""
    large = [note for note in found.gate.reasons if note.code == EstimateCode.POSITION_RESIDUALS_LARGE]
    share = max((float(note.data["motion_percent"]) for note in large), default=float("inf"))
    return found.outcome is Outcome.MISMATCH and share > 100.0 * LARGEST_SHARE
