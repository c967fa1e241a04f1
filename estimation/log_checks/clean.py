"""`clean_log(record, parameters)`: the checks of a log before anything is fitted to it."""

from collections.abc import Mapping
from dataclasses import dataclass

from estimation.log_checks.averaged import without_overlapping_means
from estimation.log_checks.channel_names import MEASURED, POSITION, PRESSURE, SPEED, VELOCITY
from estimation.log_checks.channel_physics import channel_mistakes
from estimation.log_checks.discontinuities import without_discontinuities
from estimation.log_checks.dropout import without_dropouts
from estimation.log_checks.few_digits import with_even_steps
from estimation.log_checks.filtered import independent_variance, without_correlated_noise
from estimation.log_checks.held import without_held_values
from estimation.log_checks.held_alone import without_temporary_holds
from estimation.log_checks.hum import without_hum
from estimation.log_checks.late_velocity import without_late_velocity
from estimation.log_checks.logged_on_change import logged_on_change
from estimation.log_checks.measurement_noise import SMALLEST_VARIANCE, measurement_variances, rounded_variance
from estimation.log_checks.notes import LoggerCode
from estimation.log_checks.outliers import without_gross_outliers
from estimation.log_checks.position_range import without_position_beyond_range
from estimation.log_checks.sample_time import require_fast_enough
from estimation.log_checks.sensor_check import sensor_objections, without_saturated
from estimation.log_checks.sent_twice import without_rows_sent_twice
from estimation.log_checks.unit_change import unit_changes
from estimation.log_checks.velocity_offset import without_velocity_offset
from estimation.notes import SensorCode
from plant.eha.model import EhaParameters
from plant.eha.scales import natural_frequency
from plant.log.record import Record
from plant.notes import Note

CLEANED = (SPEED, POSITION, VELOCITY, PRESSURE)
"""Channels whose gross outliers are left out."""


@dataclass(frozen=True, eq=False)
class CleanLog:
    """A log without the samples that its sensors did not measure.

    Parameters
    ----------
    record : Record
        The log, without repeated samples and rows, dropouts, gross outliers, clipped pressures and positions, steps of
        a zero, hum, a late velocity or an offset of it, and samples of correlated noise; its longest part if rows were
        lost. Steps of a channel with few significant digits have one size.
    variances : Mapping[str, float]
        Measurement variance of each of its channels [SI squared].
    left_out : tuple of Note
        Notes on what was left out.
    objections : tuple of Note
        Sensors that have failed; each note names its ``channel``.
    mistakes : tuple of Note
        Channels with a wrong sign, unit or name. With one, nothing is concluded from the log.
    """

    record: Record
    variances: Mapping[str, float]
    left_out: tuple[Note, ...]
    objections: tuple[Note, ...]
    mistakes: tuple[Note, ...] = ()

    @property
    def filtered(self) -> bool:
        """Whether a pressure was filtered before it was logged."""
        return any(note.code == SensorCode.FILTERED for note in self.left_out)

    @property
    def averaged(self) -> int:
        """Rows of which each pressure is the mean, 1 if it was not averaged."""
        return next((int(str(one.data["rows"])) for one in self.left_out if one.code == LoggerCode.AVERAGED), 1)

    @property
    def speed_held(self) -> bool:
        """Whether motor speed was logged at a lower rate than the rest, so that the log was reduced to its samples."""
        return any(note.code == SensorCode.SPEED_HELD for note in self.left_out)

    def objections_to(self, channels: tuple[str, ...]) -> tuple[Note, ...]:
        """Return the objections to the sensors of some channels.

        Returns
        -------
        tuple of Note
            Empty for sound sensors.
        """
        return tuple(note for note in self.objections if note.data["channel"] in channels)


def clean_log(record: Record, parameters: EhaParameters) -> CleanLog:
    """Check a log's sensors once: noise, outliers, clipping, frozen or dead channels.

    Parameters
    ----------
    parameters : EhaParameters
        The actuator, for its relief valve and for the motion due to its pump.

    Raises
    ------
    LogError
        If samples are more than a tenth of a second apart.
    """
    require_fast_enough(record.sample_time)
    written, digits = with_even_steps(record)
    sampled, held = without_held_values(written)
    sent_once, twice = without_rows_sent_twice(sampled)
    whole, dropouts = without_dropouts(sent_once)
    changes = unit_changes(whole)
    live, alone = without_temporary_holds(whole)
    sound, outliers = without_gross_outliers(live, CLEANED)
    clipped: tuple[Note, ...] = ()
    if PRESSURE in sound:
        sound, clipped = without_saturated(sound, parameters)
    sound, beyond = without_position_beyond_range(sound)
    mended, steps = (sound, ()) if changes else without_discontinuities(sound)
    if steps and not (changes := channel_mistakes(sound, parameters)):  # a channel of wrong sign, unit or name may jump
        sound = mended
    sound, hum = without_hum(sound)
    sound, offset = without_velocity_offset(sound)
    sound, late = without_late_velocity(sound)
    known = [name for name in MEASURED if name in sound]
    objections = (*sensor_objections(sound, parameters), *logged_on_change(sampled))
    accused = {note.data["channel"] for note in objections}
    stale = PRESSURE in accused  # frozen, or logged on change
    mistakes = changes or channel_mistakes(sound.replace(**{PRESSURE: None}) if stale else sound, parameters)
    if mistakes:  # a sensor cannot be judged by mistaken channels
        objections = steps = ()
    if VELOCITY in accused:  # the offset of a dead sensor says nothing
        offset = ()
    every, (sound, filtered, thinned) = sound, without_overlapping_means(sound)
    if not filtered:
        sound, filtered = without_correlated_noise(sound, natural_frequency(parameters))
        channels = [str(note.data["channel"]) for note in filtered]
        found = {name: independent_variance(sound[name]) for name in channels}
        thinned = {name: one for name, one in found.items() if one is not None}
    as_logged = (*digits, *held, *twice, *dropouts, *alone)
    left_out = (*as_logged, *outliers, *clipped, *beyond, *steps, *hum, *offset, *late, *filtered)
    variances = {**measurement_variances(sound, known), **_at_least_rounding(thinned, every)}
    return CleanLog(sound, variances, left_out, objections, mistakes)


def _at_least_rounding(variances: Mapping[str, float], every: Record) -> Mapping[str, float]:
    """Return variances of channels of which one sample in several was kept, at least those of all samples' rounding."""
    least = SMALLEST_VARIANCE[PRESSURE]
    return {name: max(one, least, rounded_variance(every[name])) for name, one in variances.items()}
