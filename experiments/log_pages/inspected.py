"""Contents of an unknown log as entries of the JSON contract: tables, columns, likely channels, readability."""

import json
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.actuators import DEFAULT, actuator, kinds_by_columns
from experiments.command.json_output import Result
from experiments.command.logs import catch_log_warnings, read_log
from experiments.command.terminal import sparkline
from plant.errors import HydrostateError

if TYPE_CHECKING:
    from estimation.log_checks.channel_guess import ChannelGuess
    from experiments.actuator_kind import ActuatorKind
    from plant.log.inspection import ColumnFacts, TableFacts

BLANK: Result = dict.fromkeys(("plant", "tables", "columns", "options", "reads"))

SPARKLINE_WIDTH = 24
"""Width of a plot on the terminal [characters]."""

GUESSED_UNIT_COMMENT = "  # the file gives no known unit: check this one"
"""Comment after a guessed unit in a rig file."""


def inspect_log(
    log: Path, plant: str | None, sample_time: float | None = None, beside: Sequence[Path] = ()
) -> "tuple[dict[str, Any], list[TableFacts]]":
    """Return the contents of a log as entries of the JSON contract, and its tables.

    Parameters
    ----------
    plant : str or None
        Kind of actuator. If not given, it is inferred from the column names, with the gear-pump actuator as default.
    sample_time : float, optional
        Time between rows of a log without a time column [s].
    beside : sequence of Path
        Files from other loggers in the same test.

    Raises
    ------
    HydrostateError
        If a file cannot be opened, or there is no such kind.
    """
    from plant.log.checks import missing_required
    from plant.log.formats.detect import open_tables
    from plant.log.guess import in_usual_order
    from plant.log.inspection import inspect_table

    tables = [inspect_table(one) for path in [log, *beside] for one in open_tables(path)]
    kind = actuator(plant or DEFAULT)
    guesses = _channel_guesses(tables, kind)
    if plant is None and missing_required(kind.required, {one.guess.channel for one in guesses}):
        names = [column.heading.name for facts in tables for column in facts.columns]
        kinds = kinds_by_columns(names)  # imports all kinds of actuator
        if len(kinds) == 1 and kinds[0] != kind.name:
            kind = actuator(kinds[0])
            guesses = _channel_guesses(tables, kind)
    sure = {one.guess.channel: one.guess.spec for one in guesses if one.guess.sure >= 0.5}
    columns = {channel: sure[channel] for channel in in_usual_order(sure)}
    reads = _read_attempt(log, columns, kind, sample_time, beside)
    found = _entries(tables, guesses, columns) | {"reads": reads["reads"], "message": reads["message"]}
    found["options"] = _options(columns, kind.name, sample_time, beside)
    return {"plant": kind.name, **found}, tables


def _channel_guesses(tables: "Sequence[TableFacts]", kind: "ActuatorKind") -> "list[ChannelGuess]":
    """Return the most certain guess for each channel over all tables."""
    from estimation.log_checks.channel_guess import guess_channels
    from plant.eha.model import EhaParameters
    from plant.log.columns import TIME

    healthy = kind.parameters()
    p = healthy if isinstance(healthy, EhaParameters) else EhaParameters()
    best: dict[str, ChannelGuess] = {}
    for facts in tables:
        headings = [one.heading for one in facts.columns]
        for one in guess_channels(headings, facts.numbers, p, (TIME, *kind.channels)):
            known = best.get(one.guess.channel)
            if known is None or one.guess.sure > known.guess.sure:
                best[one.guess.channel] = one
    return list(best.values())


def _read_attempt(
    log: Path, columns: Mapping[str, str], kind: "ActuatorKind", sample_time: float | None, beside: Sequence[Path]
) -> dict[str, Any]:
    """Return whether the log can be read with the block of columns, and the message of that attempt."""
    try:
        with catch_log_warnings() as said:
            record = read_log(log, {}, columns, kind.required, sample_time=sample_time, beside=beside)
    except HydrostateError as error:
        from plant.log.guess import INSPECT_ADVICE

        why = error.message.replace(f"; {INSPECT_ADVICE}", "")
        return {"reads": False, "message": f"with these columns the log cannot be read: {why}"}
    notes = "; ".join(dict.fromkeys(str(one.note) for one in said))
    about = f"{record.duration:g} s at {1.0 / record.sample_time:g} Hz, {', '.join(record)}"
    return {"reads": True, "message": f"with these columns the log reads: {about}" + (f"; {notes}" if notes else "")}


def _entries(
    tables: "Sequence[TableFacts]", guesses: "Sequence[ChannelGuess]", columns: Mapping[str, str]
) -> dict[str, Any]:
    from plant.log.columns import TIME
    from plant.log.inspection import clock_facts

    by_name = {one.guess.name: one for one in guesses}
    time = next((one for one in guesses if one.guess.channel == TIME), None)
    shown: list[dict[str, Any]] = []
    for facts in tables:
        stamps = None if time is None else facts.numbers.get(time.guess.place)
        clock = None if stamps is None else clock_facts(stamps)
        unit = "s" if time is None or stamps is None or stamps.dtype.kind == "M" else time.guess.unit or "s"
        rows = [
            {"number": number, **_column_entries(one, by_name.get(one.heading.name))}
            for number, one in enumerate(facts.columns, start=1)
        ]
        shown.append(
            {
                "label": facts.table.label,
                "rows": facts.rows,
                "step_s": facts.table.step,
                "clock": None if clock is None else {**vars(clock), "unit": unit},
                "columns": rows,
            }
        )
    return {"tables": shown, "columns": dict(columns)}


def _column_entries(column: "ColumnFacts", guess: "ChannelGuess | None") -> dict[str, Any]:
    return {
        "name": column.heading.name,
        "unit": column.heading.unit,
        "range": column.span,
        "missing": column.missing,
        "kind": "text" if column.values is None else "times" if column.heading.stamped else "numbers",
        "plot": sparkline(column.present.tolist(), SPARKLINE_WIDTH),
        "channel": None if guess is None else guess.guess.channel,
        "probability": None if guess is None else guess.guess.sure,
        "why": [] if guess is None else [one.to_dict() for one in guess.why],
    }


def _options(columns: Mapping[str, str], plant: str, sample_time: float | None, beside: Sequence[Path]) -> str:
    """Return the options that read the log in the same way as the block."""
    import shlex

    parts = [shlex.quote(f"{channel}={spec}") for channel, spec in columns.items()]
    told = [f"--columns {part}" for part in parts] + [f"--with {shlex.quote(str(one))}" for one in beside]
    kind = [] if plant == DEFAULT else [f"--plant {plant}"]
    return " ".join(kind + told + ([] if sample_time is None else [f"--sample-time {sample_time:g}"]))


def columns_block(columns: Mapping[str, str], guessed: Collection[tuple[str, str]] = ()) -> str:
    """Return the ``[columns]`` block of a rig file.

    Parameters
    ----------
    columns : Mapping[str, str]
        Column with its unit, for each channel.
    guessed : collection of tuple of str
        Channels and columns whose unit is not given in the file.
    """
    comments = {name: GUESSED_UNIT_COMMENT for name, spec in columns.items() if _is_unit_guessed(name, spec, guessed)}
    lines = [
        f"{channel} = {json.dumps(spec, ensure_ascii=True)}{comments.get(channel, '')}"
        for channel, spec in columns.items()
    ]
    return "\n".join(["[columns]", *lines])


def _is_unit_guessed(channel: str, spec: str, guessed: Collection[tuple[str, str]]) -> bool:
    """Return whether the unit of a channel's column was guessed."""
    return any(channel == of and name in (spec, spec.rpartition(":")[0]) for of, name in guessed)


def guessed_units(tables: Sequence[Mapping[str, Any]]) -> list[tuple[str, str]]:
    """Return channel and column for each guessed unit, which the file does not give."""
    from estimation.log_checks.notes import GuessCode

    rows = [row for one in tables for row in one["columns"]]
    codes = {GuessCode.UNIT_GUESSED, GuessCode.UNIT_OF_SLOPE}
    guessed = [row for row in rows if codes.intersection(why["code"] for why in row["why"])]
    return list(dict.fromkeys((row["channel"], row["name"]) for row in guessed))


def clock_sentence(one: Mapping[str, Any]) -> str:
    """Return what is known about the time of a table, as one sentence."""
    clock = one["clock"]
    if clock is None:
        step = one["step_s"]
        without = "no column holds the time: give the time between rows with --sample-time S"
        return f"the file gives a step of {step:g} s" if step else without
    flaws = [f"{clock[name]} {said}" for name, said in (("gaps", "gaps"), ("repeats", "repeats")) if clock[name]]
    if clock["backward"]:
        flaws.append(f"{clock['backward']} steps back")
    if clock["jitter"] > 1e-3:
        flaws.append(f"jitter of {100.0 * clock['jitter']:.2g} % of a step")
    return f"clock: steps of {clock['step']:.6g} {clock['unit']}; {', '.join(flaws) or 'no gaps'}"
