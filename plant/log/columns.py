"""Maps the columns of a log to channels and units: canonical names, unit suffixes, foreign names."""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from types import MappingProxyType

from plant.arrays import Array
from plant.errors import HydrostateError, LogError, MissingColumnError, RigError
from plant.log.headings import Heading, headings_of
from plant.log.scale import conversion_of, measures
from plant.units import converts

CHANNELS: Mapping[str, str] = {
    "motor_speed_rad_s": "rad/s",
    "position_m": "m",
    "velocity_m_s": "m/s",
    "differential_pressure_pa": "Pa",
    "pressure_a_pa": "Pa",
    "pressure_b_pa": "Pa",
    "motor_voltage_v": "V",
    "drive_voltage_v": "V",
    "stack_displacement_m": "m",
    "stack_force_n": "N",
    "chamber_pressure_pa": "Pa",
    **{f"electrode_{i}_v": "V" for i in range(1, 8)},
}
"""Every channel that the project reads, with its unit. `time_s` is implied by `Record.sample_time`."""

TIME = "time_s"
"""The column that says when; it becomes the record's clock."""

TIME_NAMES = ("t", "time", "times", "timestamp", "timestamps", "time_stamp", "zeit", "temps", "elapsed_time", "x_value")
"""What a time column is called where its unit stands beside the name."""

TRUTH_PREFIX = "true_"
"""Columns that begin so hold simulated truth, and are kept as they are."""

_units: dict[str, str] = {}
_stems: dict[str, str] = {}

UNITS: Mapping[str, str] = MappingProxyType(_units)
"""Unit of every column that is known, `CHANNELS` and those that other actuators brought with `know_channels`."""

STEMS: Mapping[str, str] = MappingProxyType(_stems)
"""Channel by its name without the unit."""


def know_channels(units: Mapping[str, str]) -> None:
    """Register further channels of logs, for a kind of actuator that is not shipped.

    Parameters
    ----------
    units : Mapping[str, str]
        Unit by channel; a channel's name ends in its unit, ``spool_position_m``.

    Raises
    ------
    HydrostateError
        If a channel is known in another unit, or its name does not end in it.
    """
    for name, unit in units.items():
        ending = unit_ending(unit)
        if UNITS.get(name, unit) != unit or not name.endswith(ending):
            raise HydrostateError(f"channel {name!r} in {unit!r} must end in {ending!r} and be known in no other unit")
        _units[name] = unit
        _stems[name.removesuffix(ending) + "_"] = name


def unit_ending(unit: str) -> str:
    """Return the suffix of a channel's name that states its unit.

    Returns
    -------
    str
        ``"_m_s"`` of ``"m/s"``.
    """
    return "_" + unit.replace("/", "_").replace("^", "").lower()


know_channels({TIME: "s", **CHANNELS})


@dataclass(frozen=True)
class Column:
    """A column of a log that becomes a channel.

    Parameters
    ----------
    position : int
        Where it stands in the log, from 0.
    channel : str
        The channel that it becomes, or ``time_s``.
    factor, offset : float
        ``value * factor + offset`` is in the channel's SI unit.
    """

    position: int
    name: str
    channel: str
    factor: float = 1.0
    offset: float = 0.0

    def in_si(self, values: Array) -> Array:
        """Return values in SI.

        Parameters
        ----------
        values : ndarray, shape (n,)
            Values in the unit of the log.

        Returns
        -------
        ndarray, shape (n,)
            The same array if the unit is SI.
        """
        return values if (self.factor, self.offset) == (1.0, 0.0) else values * self.factor + self.offset


def resolve_columns(
    names: "Sequence[str | Heading]", mapping: Mapping[str, str] | None, source: str
) -> tuple[Column, ...]:
    """Return the columns of a log that become channels. All others are not read.

    Parameters
    ----------
    names : Sequence[str or Heading]
        Column names, in the order of the log. ``Motor speed [rpm]`` is the motor's speed: a channel's name in any
        case, with its unit in brackets or said by the file.
    mapping : Mapping[str, str] or None
        Foreign names by channel, with a unit after a colon where it is not SI: ``"POS_MM:mm"``, or a sensor's scale,
        ``"CH2:50 bar/V"``. A mapped channel is taken from there alone, whatever the other columns are called.

    Raises
    ------
    LogError
        If a mapped column is missing, a channel or a unit is unknown, or two columns give one channel.

    Examples
    --------
    >>> [column.channel for column in resolve_columns(["time_ms", "note", "position_mm"], None, "a.csv")]
    ['time_s', 'position_m']
    """
    clean = headings_of(names)
    dated = _date_column(clean)
    found = {channel: named_column(clean, channel, spec, source) for channel, spec in (mapping or {}).items()}
    taken = {column.position for column in found.values()}
    strange: list[tuple[str, LogError]] = []
    for position, heading in enumerate(clean):
        channel = None if position in taken else TIME if dated == position else _channel_of(heading)
        if channel is None or channel in (mapping or {}):
            continue
        try:
            column = _own_column(position, heading, channel, source)
        except LogError as error:
            strange.append((channel, error))
            continue
        if channel in found:
            first = found[channel].name
            settled = "rename one of them" if first == heading.name else f"name the right one as {channel}=NAME:UNIT"
            both = f"columns {first[:80]!r} and {heading.name[:80]!r} both give {channel}, wanted one; {settled}"
            raise LogError(both, source)
        found[channel] = column
    for channel, error in strange:
        if channel not in found:
            raise error
    return tuple(found.values())


def _date_column(headings: Sequence[Heading]) -> int | None:
    """Return the only column of dates if it is the time: no other is, and it is not mapped to a channel."""
    stamped = [position for position, heading in enumerate(headings) if heading.stamped]
    if len(stamped) != 1 or _channel_of(headings[stamped[0]]) is not None:
        return None
    return None if any(_channel_of(heading) == TIME for heading in headings) else stamped[0]


_PART = re.compile(r"[.\s]")
"""What tells a part of a structure or a matrix from a unit."""


def _channel_of(heading: Heading) -> str | None:
    name = heading.name
    if name in UNITS or (name.startswith(TRUTH_PREFIX) and name != TRUTH_PREFIX):
        return name
    if heading.unit is not None and (known := STEMS.get(heading.stem + "_")):
        return known
    if heading.stem in TIME_NAMES and heading.unit is not None and measures(heading.unit, "s"):
        return TIME
    stems = [stem for stem in STEMS if name.startswith(stem) and name != stem and not _PART.search(name)]
    return STEMS[max(stems, key=len)] if stems and heading.name == heading.bare else None


def _own_column(position: int, heading: Heading, channel: str, source: str) -> Column:
    """Return the column with a channel's own name, converted from the unit in that name."""
    name = heading.name
    if channel.startswith(TRUTH_PREFIX):
        return Column(position, name, channel)
    if heading.stamped:
        return Column(position, name, channel)
    stem = next(stem for stem, owner in STEMS.items() if owner == channel)
    unit, named = heading.unit, Heading(name).unit
    if name != channel and heading.stem + "_" != stem and not (channel == TIME and heading.stem in TIME_NAMES):
        suffix = name.removeprefix(stem)
        unit = re.sub(r"([A-Za-z])([234])(?![0-9])", r"\1^\2", suffix.replace("_per_", "/").replace("_", "/"))
        named = unit
    if unit is None:
        return Column(position, name, channel)
    _require_one_unit(heading, named, channel, source)
    factor, offset = _conversion(unit, channel, name, source)
    if name == channel and (factor, offset) != (1.0, 0.0):
        raise LogError(
            f"column {name[:80]!r} says {UNITS[channel]} by its name and {unit} beside it, wanted one; "
            f"name the right one as {channel}=NAME:UNIT",
            source,
        )
    return Column(position, name, channel, factor, offset)


def named_column(headings: Sequence[Heading], channel: str, spec: str, source: str) -> Column:
    """Return the column that a user names for a channel, such as ``"POS_MM:mm"``.

    Raises
    ------
    LogError
        If the log lacks it or has it twice, or its unit does not convert.
    """
    for one in (channel, spec):
        if not isinstance(one, str):  # pyright: ignore[reportUnnecessaryIsInstance] -- Python's users give what they like
            raise LogError(f"columns must be names by channel, such as 'POS_MM:mm', got {one!r:.80}", source)
    _known_channel(channel, lambda message: LogError(message, source))
    names, bares = [one.name for one in headings], [one.bare for one in headings]
    name, unit = _name_and_unit(spec)
    if spec in names:
        name, unit = spec, None
    positions = [position for position, other in enumerate(names) if other == name]
    positions = positions or [position for position, other in enumerate(bares) if other == name]
    if not positions:
        raise MissingColumnError(channel, name, list_in_words(names), source)
    if len(positions) > 1:
        several = f"the log has it {len(positions)} times; rename the others"
        raise LogError(f"column {name[:80]!r} is needed once for {channel}, {several}", source)
    heading = headings[positions[0]]
    if unit is None:
        _require_one_unit(heading, Heading(heading.name).unit, channel, source)
    logged, unit = (None, heading.unit) if unit is None else (heading.unit, unit)
    if unit is None or channel.startswith(TRUTH_PREFIX):
        return Column(positions[0], heading.name, channel)
    return Column(positions[0], heading.name, channel, *_conversion(unit, channel, heading.name, source, logged))


def _require_one_unit(heading: Heading, named: str | None, channel: str, source: str) -> None:
    """Refuse a column whose name states one unit, in brackets or as a suffix, and whose file states another."""
    said = heading.said
    if said is None or named is None or not all(converts(one, UNITS.get(channel, named)) for one in (said, named)):
        return
    if _conversion(said, channel, heading.name, source) != _conversion(named, channel, heading.name, source):
        raise LogError(
            f"column {heading.name[:80]!r} says {named} by its name and {said} beside it, wanted one; "
            f"name the right one as {channel}=NAME:UNIT",
            source,
        )


def _name_and_unit(spec: str) -> tuple[str, str | None]:
    name, colon, unit = spec.rpartition(":")
    return (name.strip(), unit.strip()) if colon else (spec.strip(), None)


def _conversion(unit: str, channel: str, name: str, source: str, logged: str | None = None) -> tuple[float, float]:
    try:
        return conversion_of(unit, UNITS[channel], logged)
    except ValueError as error:
        option = f"--columns '{channel}={name[:80]}:UNIT' names its unit"
        raise LogError(f"column {name[:80]!r} cannot become {channel}: {error}; {option}", source) from error


def _known_channel(channel: str, error: Callable[[str], HydrostateError]) -> None:
    if channel in UNITS or channel.startswith(TRUTH_PREFIX):
        return
    near = get_close_matches(channel, UNITS, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"wanted one of {', '.join(UNITS)}"
    raise error(f"channel {channel!r} is unknown, {hint}")


def list_in_words(names: Collection[str], limit: int = 12) -> str:
    """Return names as a list in words; of many names only the first few."""
    shown = ", ".join(repr(name[:40]) for name in list(names)[:limit])
    return (shown or "no columns") + (f" and {len(names) - limit} more" if len(names) > limit else "")


def check_columns(mapping: Mapping[str, str]) -> dict[str, str]:
    """Return a checked mapping of channels to foreign columns, with its units.

    Parameters
    ----------
    mapping : Mapping[str, str]
        ``{"position_m": "POS_MM:mm"}``.

    Raises
    ------
    RigError
        If a channel is unknown, a column has no name, or a unit does not convert to the channel's.
    """
    for channel, spec in mapping.items():
        _known_channel(channel, RigError)
        name, unit = _name_and_unit(spec)
        if not name:
            raise RigError(f"{channel} wants a column as NAME or NAME:UNIT, got {spec!r}")
        if unit is not None and channel in UNITS:
            try:
                conversion_of(unit, UNITS[channel])
            except ValueError as error:
                raise RigError(f"{channel}={spec[:80]!r}: {error}") from error
    return dict(mapping)


def parse_columns(texts: Sequence[str]) -> dict[str, str]:
    """Return ``CHANNEL=NAME:UNIT`` texts of a command line as a mapping.

    Parameters
    ----------
    texts : Sequence[str]
        One channel each, the unit optional: ``["position_m=POS_MM:mm"]``.

    Returns
    -------
    dict[str, str]
        Foreign column, with its unit, by channel.

    Raises
    ------
    RigError
        If a text has another shape, a channel comes twice or is unknown, or a unit does not convert.

    Examples
    --------
    >>> parse_columns(["position_m=POS_MM:mm", "motor_speed_rad_s=RPM:rpm"])
    {'position_m': 'POS_MM:mm', 'motor_speed_rad_s': 'RPM:rpm'}
    """
    mapping: dict[str, str] = {}
    for text in texts:
        channel, equals, spec = (part.strip() for part in text.partition("="))
        if not (channel and equals and spec):
            raise RigError(f"columns must be given as CHANNEL=NAME:UNIT (position_m=POS_MM:mm), got {text!r:.80}")
        if channel in mapping:
            raise RigError(f"channel {channel!r} is needed once, got {mapping[channel]!r:.80} and {spec!r:.80}")
        mapping[channel] = spec
    return check_columns(mapping)
