"""What reading a log may bring up: what was mended at the door, and what looks like a slip of units."""

from plant.notes import Code


class LogCode(Code):
    """Notes on a log as it was read."""

    TIME_MISSING = (
        "time_missing",
        "{channel} is missing in {count} of {total} samples ({percent:.2g} %); those rows are left out",
    )
    TIME_JITTERS = (
        "time_jitters",
        "{channel} jitters by {percent:.2g} % of {sample_time_s:.6g} s at most, {rms_percent:.2g} % rms; resampled",
    )
    TIME_ROUNDED = (
        "time_rounded",
        "{channel} was rounded to {quantum_s:.2g} s; put back on the {sample_time_s:.6g} s behind it",
    )
    TIME_REPEATS = (
        "time_repeats",
        "{channel} repeats the row before in {count} of {total} rows ({percent:.2g} %); those rows are left out",
    )
    TIMES_OF_THEIR_OWN = (
        "times_of_their_own",
        "channels have times of their own; put on the {sample_time_s:.6g} s of {channel}",
    )
    LOGGERS_MERGED = (
        "loggers_merged",
        "{loggers} were put together for the {duration_s:.4g} s in which they overlap, on a clock of "
        "{sample_time_s:.6g} s",
    )
    SAMPLES_MASKED = (
        "samples_masked",
        "{channel} is missing in {count} of {total} samples ({percent:.2g} %); they are masked",
    )
    CHANNEL_SLOWER = "channel_slower", "{channel} is logged every {rows} samples of the clock"
    CHANNEL_LEFT_OUT = (
        "channel_left_out",
        "{channel} is missing in {count} of {total} samples ({percent:.2g} %); the channel is left out",
    )
    COLUMNS_ABSENT = "columns_absent", "the log has no {columns} of the rig's columns"
    METADATA_UNREADABLE = "metadata_unreadable", "its metadata are no {wanted} and are left out"
    SAMPLE_TIME_SHORT = "sample_time_short", "the sample time is {sample_time_s:.3g} s; looks like s read as ms"
    SAMPLE_TIME_LONG = "sample_time_long", "the sample time is {sample_time_s:.3g} s; looks like ms read as s"
    SPEED_CONSTANT = "speed_constant", "motor_speed_rad_s is constant, as if nothing moves: little can be learnt"
    NOTHING_MOVES = "nothing_moves", "{channels} stay constant: nothing moves, and little can be learnt"
    CHANNEL_LARGE = (
        "channel_large",
        "{channel} {verb} {size:.3g} {unit}, at most {limit:g} is usual; looks like {slip}",
    )
    CHANNEL_SMALL = (
        "channel_small",
        "{channel} {verb} only {size:.3g} {unit}, at least {limit:g} is usual; looks like {slip}",
    )
    POSITION_AND_VELOCITY_UNITS = (
        "position_and_velocity_units",
        "position_m moves {ratio:.3g} times as far as velocity_m_s integrates to; looks like {slip}",
    )
    TRAVEL_UNITS = (
        "travel_units",
        "the piston travels {travel_m:.2g} m a radian of the pump, {least:g} to {most:g} is usual; looks like a wrong "
        "unit of {channel} or speed",
    )
    CLOCK_ASSUMED = (
        "clock_assumed",
        "the log has no column of time: its samples are taken to be {sample_time_s:g} s apart",
    )
