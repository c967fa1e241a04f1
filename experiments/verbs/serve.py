"""`hydrostate serve [FOLDER]`: logs, the fleet and live streams in a browser."""

import re
import secrets
from pathlib import Path
from typing import Annotated

import typer

from experiments.command.options import Columns, Plant, RigFile, argument, load_actuator, load_columns, option
from experiments.command.terminal import emit, note
from plant.errors import HydrostateError

FOLDER = Path("hydrostate-server")

STREAM = re.compile(r"(?:(?P<name>[A-Za-z0-9_-]{1,40})=)?(?P<address>(?:tcp|mqtt)://.+)")

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate serve bench-7 --watch press=tcp://192.168.0.7:9000")
def serve(
    folder: Annotated[Path, argument("FOLDER", "Folder that keeps everything; the server continues from it.")] = FOLDER,
    host: Annotated[str, option("HOST", "Address to listen on; any but this machine's own needs a token.")] = (
        "127.0.0.1"
    ),
    port: Annotated[int, option("PORT", "Port; 0 takes a free one.", min=0, max=65535)] = 8765,
    token: Annotated[
        str | None,
        option("TEXT", "Token that clients must send; generated if one is needed.", envvar="HYDROSTATE_TOKEN"),
    ] = None,
    url: Annotated[
        str | None, option("URL", "Address at which browsers reach the server, if a proxy is in front of it.")
    ] = None,
    watch: Annotated[
        list[str] | None,
        option("NAME=ADDRESS", "A stream to watch, such as press=tcp://HOST:PORT. Repeat it for more."),
    ] = None,
    false_alarms: Annotated[float, option("RATE", "False alarms allowed per hour, for each stream [1/h].")] = 1.0,
    pattern: Annotated[
        str | None, option("PATTERN", "How logs are named, for the fleet, such as '{actuator}_{date}.csv'.")
    ] = None,
    limit: Annotated[
        list[str] | None, option("NAME=VALUE", "Limit of a severity in its unit, such as leakage_flow=2.")
    ] = None,
    maintenance: Annotated[
        Path | None,
        option("CSV", "Repairs, with the columns actuator and date; a trend restarts at a repair. Read for each page."),
    ] = None,
    plant: Plant = None,
    rig: RigFile = None,
    rigs: Annotated[
        Path | None,
        option("FOLDER", "Rig files by actuator: a log of P-12 takes P-12.toml, others that of --rig, or are refused."),
    ] = None,
    columns: Columns = None,
    workers: Annotated[int, option("N", "Number of logs to work on at once.", min=1, max=256)] = 1,
    seconds: Annotated[float, option("S", "Longest time for one log [s].", min=1.0)] = 300.0,
    memory: Annotated[int, option("MB", "Largest memory for one log [MB].", min=512)] = 3072,
    largest: Annotated[int, option("MB", "Largest log that is accepted [MB].", min=1)] = 256,
    room: Annotated[int, option("MB", "Largest size of the folder [MB].", min=1)] = 10240,
) -> None:
    """Serve web pages: drop logs, read the page of each, see the fleet, compare logs, watch live streams.

    Each log runs in its own process, which is ended if it takes too long or too much memory. Finished results stay in
    FOLDER, however the server ends. Programs use HTTP; /openapi.json describes it. This verb needs
    `pip install 'hydrostate[serve]'`.
    """
    try:
        from experiments.serve.rigs import require_rig_of_stream, require_rigs
        from experiments.serve.server import run_server
        from experiments.serve.settings import MB, Settings, is_loopback
    except ImportError as error:
        if error.name in ("fcntl", "resource"):
            raise HydrostateError(f"serve runs on Linux and macOS, this system has no {error.name}") from error
        raise HydrostateError(
            f"serve needs FastAPI, uvicorn and pebble: pip install 'hydrostate[serve]' ({error})"
        ) from error
    from experiments.fleet.naming import by_pattern
    from experiments.fleet.outlook import read_maintenance
    from experiments.verbs.fleet import limits_of_options

    load_actuator(plant, rig)
    require_rigs(plant, rigs, rig)
    streams = _streams(watch or [])
    if streams and plant not in (None, "eha"):
        raise HydrostateError(f"--watch works for the gear-pump actuator (eha) only, got --plant {plant}")
    for name in streams:
        require_rig_of_stream(name, rigs, rig)
    if pattern is not None:
        by_pattern([], pattern)
    read_maintenance(maintenance)
    if token is None and not (is_loopback(host) and url is None):
        token = secrets.token_urlsafe(24)
    settings = Settings(
        folder=folder,
        host=host,
        port=port,
        token=token,
        url=url,
        plant=plant,
        rig=None if rig is None else rig.resolve(),
        rigs=None if rigs is None else rigs.resolve(),
        columns=load_columns(columns),
        pattern=pattern,
        limits=limits_of_options(limit or []),
        maintenance=None if maintenance is None else maintenance.resolve(),
        workers=workers,
        seconds=seconds,
        memory=memory * MB,
        largest=largest * MB,
        room=room * MB,
        streams=streams,
        false_alarms=false_alarms,
    )

    def say(address: str) -> None:
        elsewhere = "; to keep them elsewhere: hydrostate serve FOLDER" if folder == FOLDER else ""
        note(f"logs, pages and results are kept in {folder.resolve()}{elsewhere}")
        emit(address)

    run_server(settings, say)


def _streams(texts: list[str]) -> dict[str, str]:
    found: dict[str, str] = {}
    for place, text in enumerate(texts, start=1):
        match = STREAM.fullmatch(text)
        if match is None:
            raise HydrostateError(
                "--watch must be NAME=tcp://HOST:PORT or NAME=mqtt://HOST/TOPIC, NAME of letters, digits, - and _, "
                f"got {text!r}"
            )
        name = match["name"] or str(place)
        if name in found:
            raise HydrostateError(f"--watch must name each stream once, got {name!r} twice")
        found[name] = match["address"]
    return found
