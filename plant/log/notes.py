"""Notes of reading a log: repairs, and suspected errors of units."""

from plant.notes import Code


class LogCode(Code):
    """Notes on a log as it was read."""

    TIME_MISSING = "{channel} is missing in {count} of {total} samples ({percent:.2g} %); those rows were left out"
    TIME_JITTERS = (
        "{channel} jitters by at most {percent:.2g} % of the sample time of {sample_time_s:.6g} s ({rms_percent:.2g} % "
        "rms); the log was resampled"
    )
    TIME_ROUNDED = (
        "{channel} was rounded to {quantum_s:.2g} s; the even sample time of {sample_time_s:.6g} s was restored"
    )
    TIME_STALLS = (
        "{channel} stops and catches up (places: {count}, by up to {longest_s:.2g} s), as when a busy computer stamps "
        "rows that waited; the rows were taken as evenly spaced by {sample_time_s:.6g} s"
    )
    TIME_REPEATS = (
        "{channel} repeats the value of the row before in {count} of {total} rows ({percent:.2g} %); those rows were "
        "left out"
    )
    TIMES_OF_THEIR_OWN = (
        "the channels have different time stamps; all were resampled to those of {channel}, with a sample time of "
        "{sample_time_s:.6g} s"
    )
    LOGGERS_MERGED = (
        "{loggers} were merged over the {duration_s:.4g} s in which they overlap, with a sample time of "
        "{sample_time_s:.6g} s"
    )
    SAMPLES_MASKED = "{channel} is missing in {count} of {total} samples ({percent:.2g} %); those samples are not used"
    LOST_VALUE = (
        "{channel} is {value:.6g} in {count} of {total} samples, far from all others, as loggers write it for lost "
        "samples; those samples are not used"
    )
    CHANNEL_SLOWER = "{channel} was logged more slowly than the others, with one value in {rows} rows"
    CHANNEL_LEFT_OUT = "{channel} is missing in {count} of {total} samples ({percent:.2g} %); the channel is not used"
    CHANNEL_LOGGED_IN_PART = (
        "{channel} is logged only from {begin_s:.4g} s to {end_s:.4g} s; only this part of the log is used"
    )
    LINES_SKIPPED = "comments or repeated headers between the rows of data were skipped (lines: {count})"
    SEGMENTS_JOINED = (
        "time begins again in segments of the file (segments: {count}); it was counted on from the date and time of "
        "each"
    )
    ROWS_LEFT_OUT = "lines that are not rows of data were left out (lines: {count}, the first is {line}: {said!r})"
    CELLS_NO_NUMBERS = (
        "column {column!r} has cells that are not numbers; these were left out (cells: {count}, the first is {said!r} "
        "in {where} {place})"
    )
    CHANNEL_OF_TEXT = "{channel} is not used, because column {column!r} holds text, such as {text!r}"
    TIME_SET = (
        "{channel} jumps by {hours:+g} h at row {row}, as when a clock is set to summer time or back; the rows were "
        "taken as evenly spaced"
    )
    TIME_IS_DATES = "column {column!r} has no unit; it was read in {unit}, so the log begins at {began}"
    TIME_UNIT_ASSUMED = (
        "column {column!r} states no known unit of time: it was read in s, so its rows are {step_s:g} s apart; if that "
        "is wrong, name its unit, --columns 'time_s={column}:ms'"
    )
    TIME_JOINED = "column {column!r} holds whole seconds; column {parts!r} was added to it as the parts of a second"
    SCALE_IN_HEADER = (
        "the file states the scale factor {factor:g} and the offset {offset:g} for column {column!r}, but not whether "
        "its values are scaled already: check them; a unit such as '{factor:g} bar' scales them"
    )
    TIME_STRAYS = (
        "{channel} changes by {step_s:.6g} s between the {end} row and the one beside it, which does not fit the other "
        "rows; that row was left out"
    )
    TIME_RAN_OVER = (
        "{channel} falls back by {span_s:.10g} s, like a counter that overflows (places: {count}, the first at row "
        "{row}); the rows were read as one log"
    )
    ROWS_NEWEST_FIRST = "rows stand with the newest first; they were read from the last to the first"
    ROWS_SORTED = (
        "rows do not stand in the order of time (places: {count}, the first at row {row}); they were sorted by it, "
        "which makes all steps even"
    )
    END_LEFT_OUT = "the lines after row {taken}, the last row of data, were left out (lines: {count})"
    COLUMNS_ABSENT = "the rig file names columns that the log does not have: {columns}; it was read without them"
    COLUMN_OVERLOOKED = (
        "column {column!r} was not used, but it may be {channel}; if it is, name it under [columns] in the rig file, "
        "or add --columns '{option}'"
    )
    CHAMBER_ALONE = "{channel} was not used: differential pressure also needs {other}"
    METADATA_UNREADABLE = "the log's metadata are not a valid {wanted} and were ignored"
    SAMPLE_TIME_SHORT = (
        "the sample time is {sample_time_s:.3g} s, which is unusually short: check the unit (s read as ms, days as s?)"
    )
    SAMPLE_TIME_LONG = (
        "the sample time is {sample_time_s:.3g} s, which is unusually long: check the unit (ms read as s?)"
    )
    NOTHING_MEASURED = (
        "every channel is constant, so nothing was measured: check the columns, or log again while the actuator moves"
    )
    SPEED_CONSTANT = (
        "motor_speed_rad_s is constant, so the log can show little: check its column, or log again while the speed "
        "changes"
    )
    NOTHING_MOVES = (
        "{channels} stay constant, so the log can show little: check their columns, or log again while the piston moves"
    )
    CHANNEL_LARGE = (
        "{channel} {verb} {size:.3g} {unit}, but at most {limit:g} {unit} is usual: check the unit ({slip}?)"
    )
    CHANNEL_SMALL = (
        "{channel} {verb} only {size:.3g} {unit}, but at least {limit:g} {unit} is usual: check the unit ({slip}?)"
    )
    POSITION_AND_VELOCITY_UNITS = (
        "position_m moves {ratio:.3g} times as far as the integral of velocity_m_s: check the units ({slip}?)"
    )
    TRAVEL_UNITS = (
        "the piston travels {travel_m:.2g} m per radian of the pump, but {least:g} to {most:g} m is usual: check the "
        "units of {channel} and of motor speed"
    )
    TIME_REPLACED = (
        "{channel} does not increase in {count} places, the first in row {row}; all rows were taken as evenly spaced "
        "by {sample_time_s:g} s, as asked: if another test begins there, keep one side of it"
    )
    TIME_KEPT = (
        "{channel} says that samples are {sample_time_s:.4g} s apart: this is used, and not the {asked_s:.4g} s that "
        "were given; if the times are wrong, name their unit, or leave them out of the log"
    )
    CLOCK_ASSUMED = (
        "the log has no time column: a sample time of {sample_time_s:g} s was assumed; a column time_s or "
        "--sample-time gives another"
    )
    NAMES_UNPLACED = (
        "{count} names stand above {columns} columns ({names}), so none of them is used: the columns are called column "
        "1 to column {columns}. Give the line as many names as the rows have cells"
    )
    TIME_UNNAMED = (
        "column {column!r} rises by about {step:g} from row to row, as a time does: if it is the time, name it and its "
        "unit, --columns 'time_s={column}:s'"
    )
