"""Notes on the columns of an unknown log, and on how its logger wrote them."""

from plant.notes import Code


class GuessCode(Code):
    """Evidence that a column of an unknown log is a channel; columns count from 1."""

    CALLED_SO = "its name says so"
    DATES = "it holds dates or times of the day"
    UNIT_FITS = "{unit} is a unit of this channel"
    UNIT_GUESSED = "no known unit is given; its size is usual in {usual}: {unit} was taken, so check it"
    UNIT_OF_SLOPE = "no known unit is given; {unit} was taken, which makes it the slope of column {column}"
    INCREASES = "it increases by {step:.6g} from row to row"
    HAS_SLOPE = "column {column} is its slope (correlation {correlation:.3f})"
    IS_SLOPE = "it is the slope of column {column} (correlation {correlation:.3f})"
    FOLLOWS = "it follows the motion in column {column} (correlation {correlation:.2f})"
    OPPOSES = (
        "it goes against the motion in column {column} (correlation {correlation:.2f}): if its sensor is reversed, put "
        "a minus before its unit"
    )
    IS_DIFFERENCE = "it is the difference of columns {one} and {other}"


class LoggerCode(Code):
    """Effects of how a logger writes a channel."""

    LOGGED_ON_CHANGE = (
        "{channel} was logged only when it had changed by {percent:.2g} % of its standard deviation, and repeated in "
        "between (dead band or compression of the logger)"
    )
    FEW_DIGITS = (
        "{channel} was written with {digits} significant digits: its steps grow with its size, so it was rounded to "
        "the largest step; write 7 digits or more"
    )
    AVERAGED = (
        "each value of {channel} is a moving average over {rows} rows ({span_ms:.3g} ms): one value in {rows} was "
        "used, and the model was averaged alike"
    )
