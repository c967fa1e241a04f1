"""What reading a log may bring up: what was mended at the door, and what looks like a slip of units."""

from plant.notes import Code


class LogCode(Code):
    """Notes on a log as it was read."""

    TIME_MISSING = "{channel} is missing in {count} of {total} samples ({percent:.2g} %); those rows are left out"
    TIME_JITTERS = (
        "{channel} jitters by {percent:.2g} % of {sample_time_s:.6g} s at most, {rms_percent:.2g} % rms; resampled"
    )
    TIME_ROUNDED = "{channel} was rounded to {quantum_s:.2g} s; put back on the {sample_time_s:.6g} s behind it"
    TIME_REPEATS = (
        "{channel} repeats the row before in {count} of {total} rows ({percent:.2g} %); those rows are left out"
    )
    TIMES_OF_THEIR_OWN = "channels have times of their own; put on the {sample_time_s:.6g} s of {channel}"
    LOGGERS_MERGED = (
        "{loggers} were put together for the {duration_s:.4g} s in which they overlap, on a clock of "
        "{sample_time_s:.6g} s"
    )
    SAMPLES_MASKED = "{channel} is missing in {count} of {total} samples ({percent:.2g} %); they are masked"
    CHANNEL_SLOWER = "{channel} is logged every {rows} samples of the clock"
    CHANNEL_LEFT_OUT = "{channel} is missing in {count} of {total} samples ({percent:.2g} %); the channel is left out"
    COLUMNS_ABSENT = "the log has no {columns} of the rig's columns"
    METADATA_UNREADABLE = "its metadata are no {wanted} and are left out"
    SAMPLE_TIME_SHORT = "the sample time is {sample_time_s:.3g} s; looks like s read as ms"
    SAMPLE_TIME_LONG = "the sample time is {sample_time_s:.3g} s; looks like ms read as s"
    SPEED_CONSTANT = "motor_speed_rad_s is constant, as if nothing moves: little can be learnt"
    NOTHING_MOVES = "{channels} stay constant: nothing moves, and little can be learnt"
    CHANNEL_LARGE = "{channel} {verb} {size:.3g} {unit}, at most {limit:g} is usual; looks like {slip}"
    CHANNEL_SMALL = "{channel} {verb} only {size:.3g} {unit}, at least {limit:g} is usual; looks like {slip}"
    POSITION_AND_VELOCITY_UNITS = (
        "position_m moves {ratio:.3g} times as far as velocity_m_s integrates to; looks like {slip}"
    )
    TRAVEL_UNITS = (
        "the piston travels {travel_m:.2g} m a radian of the pump, {least:g} to {most:g} is usual; looks like a wrong "
        "unit of {channel} or speed"
    )
    CLOCK_ASSUMED = "the log has no column of time: its samples are taken to be {sample_time_s:g} s apart"
