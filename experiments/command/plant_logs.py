"""`estimate` and `diagnose` with `--plant`: logs of actuators with a drive, sensors and faults of their own."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.command.json_output import Result
from experiments.command.options import MOTOR, STACK, refuse_given, require_one_of
from experiments.command.streams import table

if TYPE_CHECKING:
    from rich.console import RenderableType


def plant_logs_command(
    plant: str,
    logs: Sequence[Path],
    *,
    diagnosing: bool,
    sensors: str,
    bias_pressure: float | None,
    load: float | None,
    healthy_log: Path | None,
    expected: str | None,
    columns: Sequence[str] | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Estimate or diagnose logs of another actuator, and leave with the exit code.

    Parameters
    ----------
    plant : str
        ``piezo-stack`` or ``diaphragm-motor``.
    logs : sequence of Path
        The logs.
    diagnosing : bool
        Whether a fault is wanted, not quantities.
    sensors : str
        The piezo stack's channels that are used; all where empty.
    bias_pressure, load : float or None
        Of the runs: the piezo stack's [Pa]; mass [kg] or, of the diaphragm motor, force [N].
    healthy_log : Path or None
        A run of the healthy actuator to calibrate on.
    expected : str or None
        The condition or fault that is expected.
    columns : sequence of str or None
        Foreign columns, as ``--columns`` gives them.
    out : Path or None
        Where results are written too.
    as_json : bool
        Whether a program reads.

    Raises
    ------
    HydrostateError
        If an option is not usable.
    """
    require_one_of("--plant", plant, [STACK, MOTOR])
    if plant == MOTOR:
        from experiments.command.motor_logs import motor_logs_command

        refuse_given({"--bias-pressure": bias_pressure, "--sensors": sensors or None}, f"does not go with {MOTOR}")
        motor_logs_command(
            logs,
            diagnosing=diagnosing,
            load=load,
            healthy_log=healthy_log,
            expected=expected,
            columns=columns,
            out=out,
            as_json=as_json,
        )
    from experiments.command.stack_logs import stack_logs_command

    stack_logs_command(
        logs,
        diagnosing=diagnosing,
        sensors=sensors,
        bias_pressure=bias_pressure,
        load=load,
        healthy_log=healthy_log,
        expected=expected,
        columns=columns,
        out=out,
        as_json=as_json,
    )


def quantities_shown(results: Sequence[Result]) -> "Iterable[RenderableType]":
    """Show what was estimated of each log: a table of quantities with their intervals, and the outcome in words.

    Parameters
    ----------
    results : sequence of Result
        One a log, with ``quantities``.

    Yields
    ------
    RenderableType
        For the terminal.
    """
    for result in results:
        shown = table("quantity", "value", "95 % interval", "unit", title=result["file"])
        for name, entry in result["quantities"].items():
            words = "-" if entry["ci95"] is None else f"{entry['ci95'][0]:.4g} to {entry['ci95'][1]:.4g}"
            value = "-" if entry["value"] is None else f"{entry['value']:.4g}"
            shown.add_row(name.replace("_", " "), value, words, entry["unit"])
        yield shown
        yield f"{result['file']}: {result['outcome'].replace('_', ' ')}: {result['message']}"
