"""`estimate_log(record, rig) -> Finding`: bulk modulus and leakage from a log of the gear-pump actuator."""

from estimation.eha.bulk_modulus import DEFAULT_OPTIONS, FITTED, EstimateOptions, estimate_clean, left_out
from estimation.eha.explanation_notes import notes_of
from estimation.eha.result import BulkModulusEstimate
from estimation.eha.rig_share import another_oil
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
"""What the registry calls the gear-pump actuator."""

NOT_THE_LOGS = {
    EstimateCode.BOUND_TOO_WIDE,
    EstimateCode.PRESSURE_RESIDUALS_SMALL,
    EstimateCode.POSITION_RESIDUALS_LARGE,
    EstimateCode.FRICTION_LAWS_DISAGREE,
    EstimateCode.FORCES_ON_ANY_SCALE,
    EstimateCode.WEAKLY_HELD,
    EstimateCode.NOT_HELD,
}
"""Reasons of a gate that speak against bulk modulus alone: the log holds too little of it, its oil is too stiff for the
noise of position, or it depends on how the piston starts and stops, which decides no condition."""

LARGEST_SHARE = 0.06
"""Share of the motion that a fit without pressure may leave where anything is concluded from the log [fraction]: as
much as means over 0.1 s may differ from a circuit's (`faults.diagnosis.circuits.out_of_model`)."""

NOT_TOLD = frozenset({RigCode.MAKEUP_UNSEEN})
"""Remarks of a fit that say what a log does not tell, and nothing of the numbers that it does."""


def estimate_log(record: Record, rig: Rig, options: EstimateOptions = DEFAULT_OPTIONS) -> Finding:
    """Estimate effective bulk modulus, and what is found along with it, from a log.

    Parameters
    ----------
    record : Record
        The log.
    rig : Rig
        The actuator: parameters, and how well they are known.
    options : EstimateOptions
        How; all automatic if not given.

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
    return finding_of(*estimated(clean_log(record, rig.parameters), rig, options), rig)


def estimated(log: CleanLog, rig: Rig, options: EstimateOptions) -> tuple[CleanLog, BulkModulusEstimate]:
    """Return a log with its estimate.

    Parameters
    ----------
    options : EstimateOptions
        How.

    Returns
    -------
    tuple of CleanLog and BulkModulusEstimate
        Both.
    """
    return log, estimate_clean(log, rig.parameters, options, rig.spreads)


def finding_of(log: CleanLog, found: BulkModulusEstimate, rig: Rig) -> Finding:
    """Return an estimate as a finding.

    Parameters
    ----------
    found : BulkModulusEstimate
        Its estimate.
    rig : Rig
        The actuator, as its file has it.

    Returns
    -------
    Finding
        Without a condition.
    """
    return Finding(
        actuator=KIND,
        outcome=found.outcome,
        quantities={"bulk_modulus": found.quantity, **_others(found)},
        gate=found.gate,
        channels=found.channels,
        notes=(
            *left_out(log, found),
            *absences(found),
            *explained(found, rig.parameters),
            *another_oil(found.value if found.gate.passed else None, rig.parameters),
            *found.rig_notes,
        ),
        not_told=tuple(note for note in found.remarks if note.code in NOT_TOLD),
        evidence=found,
    )


def _others(found: BulkModulusEstimate) -> dict[str, Quantity]:
    units = {name: note.unit for name, note in parameter_notes(EhaParameters).items()}
    return {
        name: found.with_total(name, Quantity.normal(value, std, units.get(name, "1")))
        for name, (value, std) in found.others.items()
    }


def explained(found: BulkModulusEstimate, parameters: EhaParameters) -> tuple[Note, ...]:
    """Return the notes on the explanation of a log by rig, oil or logger, and the remarks of its fit.

    Parameters
    ----------
    parameters : EhaParameters
        The actuator, as its rig file has it.

    Returns
    -------
    tuple of Note
        None for a plain log.
    """
    strange = () if found.explanation is None else notes_of(found.explanation, parameters)
    return (*strange, *(note for note in found.remarks if note.code not in NOT_TOLD))


def absences(found: BulkModulusEstimate) -> tuple[Note, ...]:
    """Return the note on what is lost without differential pressure; nothing if it is used.

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


def refused(found: BulkModulusEstimate) -> tuple[Note, ...]:
    """Return why the fit of a log is refused, so that nothing can be concluded from it.

    A form that is told leakage and friction may be refused because the actuator is not the one that it was told of;
    that is no objection to the log.

    Returns
    -------
    tuple of Note
        Reasons of its gate; none where it passed, or where they speak against bulk modulus alone. A log of which the
        model leaves much of the motion, however fine the encoder, is refused for all of them.
    """
    if found.form not in FITTED:
        return ()
    spared = {EstimateCode.BOUND_TOO_WIDE} if _moves_otherwise(found) else NOT_THE_LOGS
    return tuple(note for note in found.gate.reasons if note.code not in spared)


def _moves_otherwise(found: BulkModulusEstimate) -> bool:
    """Return whether the piston moves unlike the model, by a large share of its motion, not only of the noise."""
    large = [note for note in found.gate.reasons if note.code == EstimateCode.POSITION_RESIDUALS_LARGE]
    share = max((float(note.data["motion_percent"]) for note in large), default=float("inf"))
    return found.outcome is Outcome.MISMATCH and share > 100.0 * LARGEST_SHARE
