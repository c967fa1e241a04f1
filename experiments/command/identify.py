"""`hydrostate identify LOG...`: the discrete transfer function of each log."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import finish, read_log, run_logs
from experiments.command.options import (
    SEED,
    Columns,
    Json,
    Logs,
    Out,
    RigFile,
    Seed,
    load_columns,
    load_rig,
    require_positive,
)
from experiments.command.streams import short_names, table

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.identification.linear_model import LinearModel

TABLE_6_TIME = 1e-3
"""Sample time of Table 6 as we read it [s] (errata E14)."""

NOTHING: Result = {
    "numerator": None,
    "denominator": None,
    "sample_time_s": None,
    "fit_percent": None,
    "covariance": None,
    "dc_gain": {"value": None, "std": None},
    "bandwidth_hz": None,
    "delay": {"samples": None, "seconds": None},
}
"""The entries of a log that could not be used."""

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate identify prbs.csv --order 2 --numerator 3 --sample-time 1e-3 --json")
def identify(
    logs: Logs,
    order: Annotated[int, typer.Option(min=1, metavar="INT", help="Order of the denominator.")] = 2,
    numerator: Annotated[int, typer.Option(min=1, metavar="INT", help="Coefficients of the numerator.")] = 3,
    delay: Annotated[int, typer.Option(min=0, metavar="INT", help="Dead time [samples of the model].")] = 0,
    sample_time: Annotated[
        float | None,
        typer.Option(metavar="S", help="Of the model [s]; 1e-3 (Table 6), or the log's where that is longer."),
    ] = None,
    filter_hz: Annotated[
        float | None,
        typer.Option(
            metavar="HZ", help="Zero-phase low-pass of input and output before the fit [Hz]; none if not given."
        ),
    ] = None,
    input_channel: Annotated[str, typer.Option("--input", metavar="CHANNEL", help="Input.")] = "motor_speed_rad_s",
    output_channel: Annotated[str, typer.Option("--output", metavar="CHANNEL", help="Output.")] = "velocity_m_s",
    rig: RigFile = None,
    columns: Columns = None,
    out: Out = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Identify the discrete transfer function from motor speed [rad/s] to velocity [m/s] of each log.

    An output-error fit with covariance; the defaults are the form of Table 6. Differential pressure is not used, so
    its absence costs nothing. Nothing here is random, so the seed changes nothing.
    """
    from estimation.identification.from_record import identify_record

    require_positive("--sample-time", sample_time, "s")
    require_positive("--filter-hz", filter_hz, "Hz")
    bench, mapping = load_rig(rig), load_columns(columns)
    prepare_output(out)
    chosen = {"input": input_channel, "output": output_channel, "rig": bench.name, "seed": seed}

    def work(log: Path) -> Result:
        record = read_log(log, bench.columns, mapping)
        model = identify_record(
            record,
            output=output_channel,
            input=input_channel,
            sample_time=max(TABLE_6_TIME, record.sample_time) if sample_time is None else sample_time,
            n_numerator=numerator,
            n_denominator=order,
            delay=delay,
            filter_cutoff_hz=filter_hz,
        )
        return {**chosen, **_entries(model)}

    batch = run_logs(logs, work, {**NOTHING, **chosen}, "identifying")
    finish(batch, _screen, as_json=as_json, out=out)


def _entries(model: "LinearModel") -> dict[str, Any]:
    lag = {"samples": model.delay, "seconds": model.delay * model.sample_time}
    bandwidth = model.bandwidth_hz
    extent = "not below the Nyquist frequency" if bandwidth is None else f"{bandwidth:.3g} Hz"
    return {
        "outcome": "ok",
        **model.to_dict(),
        "dc_gain": {"value": model.dc_gain, "std": model.dc_gain_std},
        "bandwidth_hz": bandwidth,
        "delay": lag,
        "message": f"fit {model.fit_percent:.1f} %, gain {model.dc_gain:.4g}, bandwidth {extent}",
    }


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    shown = table("log", "fit [%]", "gain", "bandwidth [Hz]", "coefficients, q^0 q^-1 ...")
    for name, result in zip(short_names(results), results, strict=True):
        gain = result["dc_gain"]
        bandwidth = "-" if result["bandwidth_hz"] is None else f"{result['bandwidth_hz']:.3g}"
        coefficients = f"b {_spaced(result['numerator'])}\nf {_spaced(result['denominator'])}"
        spread = f"{gain['value']:.4g} ± {gain['std']:.1g}"
        shown.add_row(name, f"{result['fit_percent']:.2f}", spread, bandwidth, coefficients)
    yield shown
    first = results[0]
    yield f"From {first['input']} to {first['output']}, ± one standard deviation; sample times are in --json and --out."


def _spaced(values: Sequence[float]) -> str:
    return "  ".join(f"{value:.5g}" for value in values)
