"""Guesses which column is which channel by name and unit. Other code then checks the values."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from plant.errors import NoChannelError
from plant.log.chamber_pressures import CHAMBERS, PRESSURE, has_pressure_difference
from plant.log.columns import CHANNELS, TIME, UNITS, list_in_words, unit_ending
from plant.log.headings import Heading, hides_unit, is_misspelt, timeless_hint
from plant.log.notes import LogCode
from plant.log.scale import measures
from plant.notes import Note
from plant.units import LOWER_CASE

NAMES: Mapping[str, tuple[tuple[str, float], ...]] = {
    TIME: (
        (r"(^|_)(time|zeit|zeitstempel|time_?stamps?|temps|tiempo|uhrzeit|clock|elapsed|datetime)(_|$)", 4.0),
        (r"^(t|date|datum|x_value)(_|$)", 3.0),
    ),
    "motor_speed_rad_s": (
        (r"(motor|mot|pump\w*|shaft|servo|drive|welle|moteur).*(speed|rpm|drehzahl|omega|vel\w*|spd|_n$|_w$)", 5.0),
        (r"drehzahl|(^|_)rpm(_|$)|omega|angular|regime|(^|_)n_?(mot\w*|pump\w*|ist|act)(_|$)", 4.0),
        (r"^(speed|spd|n|w|nmot|revs?)(_|$)", 2.5),
    ),
    "position_m": (
        (
            r"position|(^|_|kolben)weg(_|$)|(^|_|kolben)hub(_|$)|stroke|displacement|lvdt|deplacement|travel|extension",
            4.0,
        ),
        (r"(^|_)(pos|lvdt|enc\w*|s_ist|x_ist|x_?p|x_?cyl\w*|x_?piston)(_|$)", 3.5),
        (r"^(x|s|y)(_|$)", 1.5),
    ),
    "velocity_m_s": (
        (
            r"velocity|geschwindigkeit|(piston|rod|cyl\w*|kolben).*(speed|vel|_v$)|x_?dot|(^|_)v_?(ist|act|kolben|p)(_|$)",
            4.0,
        ),
        (r"(^|_)vel(_|$)|vitesse", 3.0),
        (r"^(v|speed)(_|$)", 1.5),
    ),
    "differential_pressure_pa": (
        (
            r"diff\w*_?(press|druck)|delta_?p|(^|_)(δ|∆|d)_?p(_|$)|(press\w*|druck)_?diff|(^|_)dp(_|$)|(load|last)_?(press|druck)|(^|_)p_?(load|diff|l)(_|$)",
            5.0,
        ),
        (r"^(pressure|press|druck)$", 2.5),
        (r"^(p|press\w*|druck)(_|$)", 1.0),
    ),
    "pressure_a_pa": ((r"(^|_)p(ress\w*)?_?(a|1)(_|$)|druck_?(a|1)(_|$)|(chamber|port|side|kammer)_?(a|1)(_|$)", 4.0),),
    "pressure_b_pa": ((r"(^|_)p(ress\w*)?_?(b|2)(_|$)|druck_?(b|2)(_|$)|(chamber|port|side|kammer)_?(b|2)(_|$)", 4.0),),
    "motor_voltage_v": ((r"volt|spannung|tension|(^|_)u(_|$)|(^|_)u_?mot", 3.0),),
}
"""What each channel is called on benches, and how much such a name says [log-odds]; judged."""

OTHER_QUANTITIES = re.compile(
    r"(^|_)(soll\w*|set\w*|sp|ref\w*|cmd|command\w*|demand|target|desired|err\w*|max|min|limit|std|temp\w*|status|flag|"
    r"count\w*|index|filter\w*|time_of(?!_day))(_|$)"
)
"""Words of columns that are not the measured channel: set points, errors, temperatures."""

NOT_IT, UNIT_FITS, NONE_OF_THEM = -4.0, 3.0, 2.0
"""What such a word says, what a unit says, and that none of the columns may be the channel [log-odds]; judged."""

VALVE_NAMES = re.compile(r"spool|valve|ventil|schieber")
"""Names of the columns of an actuator that a valve controls."""

VALVE_REMARK = (
    "; an actuator that a valve controls cannot be diagnosed, but `hydrostate identify FILE --input COLUMN "
    "--output COLUMN` fits a model"
)
"""What is said of a log without motor speed that has such a column."""

SHOWN_PROBABILITY = 0.5
"""Probability from which an error names a guess."""


@dataclass(frozen=True)
class Guess:
    """A column that may be a channel.

    Parameters
    ----------
    channel : str
        The channel.
    place : int
        Where the column stands, from 0.
    name : str
        What it is called.
    unit : str or None
        Its unit as far as known.
    points : float
        What speaks for it [dimensionless]: log-odds.
    sure : float
        Probability, of all columns and of none [fraction].
    """

    channel: str
    place: int
    name: str
    unit: str | None
    points: float
    sure: float = 0.0

    @property
    def spec(self) -> str:
        """The column as a rig file or ``--columns`` names it."""
        return self.name if self.unit is None else f"{self.name}:{self.unit}"


def points_by_name(heading: Heading, channel: str) -> float | None:
    """Return the log-odds that a column is a channel, by its name and unit.

    Parameters
    ----------
    heading : Heading
        The column.
    channel : str
        Of `plant.log.columns.UNITS`.

    Returns
    -------
    float or None
        Log-odds [dimensionless]; None where its unit is of something else.

    Examples
    --------
    >>> points_by_name(Heading("Motordrehzahl [U/min]"), "motor_speed_rad_s")
    8.0
    """
    if heading.stamped:
        return 8.0 if channel == TIME else None
    unit = unit_of(heading)
    fits = unit is not None and measures(unit, UNITS[channel])
    if unit is not None and not fits:
        return None
    name = heading.stem.removesuffix("_pa") if unit == "Pa" else heading.stem  # "_pa" is the unit, not chamber A
    own = channel.removesuffix(unit_ending(UNITS[channel]))
    if name == own or heading.name == channel:
        said = 6.0
    elif channel in NAMES:
        said = max((worth for pattern, worth in NAMES[channel] if re.search(pattern, name)), default=0.0)
    else:
        words = own.split("_")
        said = 4.0 * sum(word in name.split("_") for word in words) / len(words)
    if said == 0.0 and is_misspelt(name, own):
        said = 4.0
    if OTHER_QUANTITIES.search(name) and name != own:
        said += NOT_IT
    return said + (UNIT_FITS if fits else 0.0)


_SUFFIX = re.compile(
    r"(?:^|_)(rpm|mm_s|cm_s|m_s|rad_s|deg_s|mm|cm|um|ms|us|ns|sec|bar|mbar|kpa|mpa|psi|(?<=_)pa|volts?|mv|rev_min)$"
)


def unit_of(heading: Heading) -> str | None:
    """Return the unit of a column: the one given for it, or the suffix of its name.

    Examples
    --------
    >>> [unit_of(Heading(one)) for one in ("POS_MM", "V_KOLBEN_MM_S", "DP_MPA", "p_A", "Weg (0.1 mm)")]
    ['mm', 'mm/s', 'MPa', None, None]
    """
    if heading.unit is not None or heading.stamped or hides_unit(heading.name):
        return heading.unit
    found = _SUFFIX.search(heading.stem)
    unit = "" if found is None else found[1].replace("_", "/")
    return LOWER_CASE.get(unit, unit) or None


def best_guesses(points: Mapping[str, Mapping[int, float]], headings: Sequence[Heading]) -> tuple[Guess, ...]:
    """Return the most probable column of each channel, each column once, the surest channel first.

    Parameters
    ----------
    points : Mapping[str, Mapping[int, float]]
        What speaks for each column by its place, by channel [dimensionless]: log-odds.
    headings : sequence of Heading
        The columns.

    Returns
    -------
    tuple of Guess
        Channels without a column that anything speaks for are left out.
    """
    left = {channel: dict(columns) for channel, columns in points.items()}
    found: list[Guess] = []
    while True:
        best = max(
            ((worth, channel, place) for channel, columns in left.items() for place, worth in columns.items()),
            default=(0.0, "", -1),
        )
        worth, channel, place = best
        if worth <= 0.0:
            return tuple(found)
        rivals = np.array([NONE_OF_THEM, *points[channel].values()])
        sure = float(np.exp(worth - np.logaddexp.reduce(rivals)))
        heading = headings[place]
        found.append(Guess(channel, place, heading.name, None if heading.stamped else unit_of(heading), worth, sure))
        del left[channel]
        for columns in left.values():
            columns.pop(place, None)


def guess_by_name(headings: Sequence[Heading], channels: Collection[str] = (TIME, *CHANNELS)) -> tuple[Guess, ...]:
    """Return the columns that each channel may be, by name and unit alone.

    Parameters
    ----------
    headings : sequence of Heading
        What the columns are called.
    channels : collection of str
        Channels that are looked for.

    Returns
    -------
    tuple of Guess
        One a channel that is there, perhaps.

    Examples
    --------
    >>> [(one.channel, one.spec) for one in guess_by_name([Heading("Zeit [ms]"), Heading("Weg [mm]")])]
    [('time_s', 'Zeit [ms]:ms'), ('position_m', 'Weg [mm]:mm')]
    """
    points: dict[str, dict[int, float]] = {}
    for channel in channels:
        said = {place: points_by_name(heading, channel) for place, heading in enumerate(headings)}
        points[channel] = {place: worth for place, worth in said.items() if worth is not None and worth > 0.0}
    return best_guesses(points, headings)


def missing_channels(
    wanted: Sequence[str], headings: Sequence[Heading], source: str, found: Collection[str] = ()
) -> NoChannelError:
    """Return the error for missing channels: what the log has, what may be meant, which command shows more.

    Parameters
    ----------
    wanted : sequence of str
        Channels; ``"position_m or velocity_m_s"`` is one of two.
    headings : sequence of Heading
        What the columns of the log are called.
    found : collection of str
        Channels that it has; the hint names the others that an estimate gains by, too.
    """
    names = tuple(one.name for one in headings)
    asked = [name for one in wanted for name in one.split(" or ")]
    more = [name for name in _useful_channels(found) if name not in asked]
    hint = hint_of(asked, headings, more)
    return NoChannelError(f"{missing_columns_clause(wanted)}; the log has {list_in_words(names)}", source, hint, names)


def missing_columns_clause(wanted: Sequence[str]) -> str:
    """Return the clause that names missing columns.

    Examples
    --------
    >>> missing_columns_clause(["time_s"]), missing_columns_clause(["time_s", "position_m or velocity_m_s"])
    ('column time_s is missing', 'columns time_s, and position_m or velocity_m_s are missing')
    """
    if len(wanted) == 1:
        return f"column {wanted[0]} is missing"
    return f"columns {', '.join(wanted[:-1])}, and {wanted[-1]} are missing"


def unused_column_notes(headings: Sequence[Heading], found: Collection[str]) -> tuple[Note, ...]:
    """Return notes on unused columns that may improve an estimate most: pressure, or a second measurement of motion.

    Parameters
    ----------
    headings : sequence of Heading
        Columns that were not read.
    found : collection of str
        Channels that were.
    """
    return tuple(
        LogCode.COLUMN_OVERLOOKED.note(column=one.name[:60], channel=one.channel, option=option)
        for one, option in _certain_guesses(headings, _useful_channels(found))
    )


def _useful_channels(found: Collection[str]) -> list[str]:
    pressures = () if has_pressure_difference(found) else (PRESSURE, *CHAMBERS)
    return [one for one in (*pressures, "position_m", "velocity_m_s") if one not in found]


INSPECT_ADVICE = (
    "`hydrostate inspect FILE --write rig.toml` guesses which column is which and in what unit; then add --rig rig.toml"
)
"""The command that shows more; it leaves this out where it speaks itself."""


def hint_of(channels: Sequence[str], headings: Sequence[Heading], more: Sequence[str] = ()) -> str:
    """Return an option with the columns that may be meant, and the command that shows more.

    Parameters
    ----------
    channels : sequence of str
        Channels that are missing.
    headings : sequence of Heading
        What the columns are called.
    more : sequence of str
        Channels that could do without, but are better named with the others.
    """
    shown = {one.channel: option for one, option in _certain_guesses(headings, [*channels, *more])}
    # one chamber pressure is of no use without the other
    if set(CHAMBERS) <= {*channels, *more} and len(set(CHAMBERS) & set(shown)) == 1:
        shown = {name: option for name, option in shown.items() if name not in CHAMBERS}
    options = [shown[name] for name in in_usual_order(shown)] if set(shown) & set(channels) else []
    may = f"; perhaps --columns '{','.join(options)}'" if options else ""
    put = ", with the unit of each for UNIT" if any(one.endswith(":UNIT") for one in options) else ""
    timeless = timeless_hint(headings) if TIME in channels and TIME not in shown else ""
    # one of the columns in V is probably the drive
    volts = not options and sum(one.unit is not None and measures(one.unit, "V") for one in headings) > 1
    scale = (
        "; a column in V needs its sensor's scale: --columns 'position_m=NAME:20 mm/V', for example" if volts else ""
    )
    other = "" if options or TIME in channels else "; if a second logger's file has it, add --with FILE"
    valve = (
        VALVE_REMARK
        if "motor_speed_rad_s" in channels and any(VALVE_NAMES.search(one.name.lower()) for one in headings)
        else ""
    )
    return f"{may}{put}; {INSPECT_ADVICE}{scale}{other}{timeless}{valve}"


def in_usual_order(channels: Iterable[str]) -> list[str]:
    """Return channels in the usual order: time, motor speed, motion, pressures.

    Examples
    --------
    >>> in_usual_order(["velocity_m_s", "time_s", "position_m"])
    ['time_s', 'position_m', 'velocity_m_s']
    """
    usual = (TIME, *CHANNELS)
    return sorted(channels, key=lambda one: usual.index(one) if one in usual else len(usual))


def _certain_guesses(headings: Sequence[Heading], channels: Sequence[str]) -> Iterator[tuple[Guess, str]]:
    """Yield the guesses that are certain enough to show, each with the option that uses it."""
    for one in guess_by_name(headings, [name for name in channels if name in UNITS]):
        by_unit_alone = one.channel in CHAMBERS and one.points <= UNIT_FITS  # any pressure could be meant
        if one.sure >= SHOWN_PROBABILITY and one.spec.isprintable() and not by_unit_alone:
            told = one.unit is not None or one.channel == TIME or one.name == one.channel
            unit = "" if told else ":UNIT"
            yield one, f"{one.channel}={one.spec[:60]}{unit}"
