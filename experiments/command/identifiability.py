"""`hydrostate identifiability`: what an experiment would tell, before it is made."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import Batch, finish
from experiments.command.options import (
    PRESSURE,
    SEED,
    ConditionName,
    Json,
    Out,
    RigFile,
    Seed,
    load_rig,
    require_one_of,
    require_positive,
)
from experiments.command.streams import note, table
from plant.errors import DriveError, HydrostateError

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.card import Card
    from plant.eha import EhaParameters
    from plant.rig import Rig

CHANNELS: Mapping[str, str] = {"position": "position_m", "velocity": "velocity_m_s", "dp": PRESSURE}
"""What ``--sensors`` calls the channels."""

MOST_SAMPLES = 2_000_000
"""Longest experiment that is looked at."""

commands = typer.Typer()


@commands.command(
    epilog="Example: hydrostate identifiability --sensors position,velocity --drive sine --seconds 10 --rate 1000"
)
def identifiability(
    sensors: Annotated[
        str, typer.Option(metavar="LIST", help="Sensors beside motor speed, by commas: position, velocity, dp.")
    ] = "position,velocity,dp",
    noise: Annotated[str, typer.Option(metavar="NOISE", help="Noise of the sensors: bench, rig or paper.")] = "bench",
    drive: Annotated[
        str, typer.Option(metavar="DRIVE", help="Drive: sine, prbs, steps, chirp or multisine, at the paper's 4 V.")
    ] = "steps",
    seconds: Annotated[float, typer.Option(metavar="S", help="Length of the experiment [s].")] = 10.0,
    rate: Annotated[float, typer.Option(metavar="HZ", help="Samples a second [Hz].")] = 1000.0,
    ranked: Annotated[bool, typer.Option("--rank", help="Rank all drives, the one that tells most first.")] = False,
    condition: ConditionName = None,
    rig: RigFile = None,
    out: Out = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Say how well an experiment could know bulk modulus, leakage, flow bias and friction, before it is made.

    Relative standard deviations (Cramér-Rao bounds of the lumped plant, in percent), what cannot be told apart, and
    what the rig file's uncertainties add: bulk modulus enters only as chamber volume over bulk modulus. The seed is
    that of random drives.
    """
    from faults.conditions import find_condition, parameters_for
    from plant.sensors import SENSORS
    from plant.signals import DRIVES

    channels = sensed_channels(sensors)
    require_one_of("--noise", noise, [name for name in SENSORS if name != "ideal"])
    require_one_of("--drive", drive, list(DRIVES))
    require_positive("--seconds", seconds, "s")
    require_positive("--rate", rate, "Hz")
    if not 2.0 <= seconds * rate <= MOST_SAMPLES:
        raise HydrostateError(f"--seconds times --rate must be 2 to {MOST_SAMPLES} samples, got {seconds * rate:g}")
    bench = load_rig(rig)
    chosen = find_condition(condition or "normal")
    parameters = parameters_for(chosen, bench.parameters)
    prepare_output(out)
    about = {"condition": chosen.name, "rig": bench.name, "sensors": list(channels), "noise": noise}
    about |= {"seconds": seconds, "rate_hz": rate, "seed": seed}
    cards: dict[str, Card] = {}
    for name in DRIVES if ranked else [drive]:
        try:
            cards[name] = _card(name, parameters, bench, channels, about)
        except DriveError as error:
            if not ranked:
                raise
            note(f"{name} is left out: {error}")
    if not cards:
        raise HydrostateError("no drive is within this actuator's limits")
    results = _results(cards, about)
    finish(Batch(results, len(results)), _ranking if ranked else _screen, as_json=as_json, out=out)


def sensed_channels(listed: str) -> dict[str, str]:
    """Return the channels of ``--sensors``, in their usual order.

    Parameters
    ----------
    listed : str
        Names in `CHANNELS`, by commas.

    Returns
    -------
    dict[str, str]
        Channel by name.

    Raises
    ------
    HydrostateError
        If a name is unknown or comes twice.
    """
    given = [name.strip() for name in listed.split(",")]
    for i, name in enumerate(given):
        require_one_of("--sensors", name, list(CHANNELS))
        if name in given[:i]:
            raise HydrostateError(f"--sensors names {name} twice")
    return {name: channel for name, channel in CHANNELS.items() if name in given}


def _card(
    drive: str, parameters: "EhaParameters", bench: "Rig", channels: Mapping[str, str], about: Mapping[str, Any]
) -> "Card":
    import numpy as np

    from estimation.identifiability import identifiability_card
    from plant.sensors import SENSORS
    from plant.signals import make_drive

    sample_time = 1.0 / about["rate_hz"]
    speed = make_drive(drive, about["seconds"], sample_time, parameters, np.random.default_rng(about["seed"]))
    return identifiability_card(
        parameters,
        speed,
        sample_time,
        tuple(channels.values()),
        sensors=SENSORS[about["noise"]],
        uncertainties=bench.uncertainties,
    )


def _results(cards: "Mapping[str, Card]", about: Mapping[str, Any]) -> tuple[Result, ...]:
    from estimation.card import rank_drives, sentences

    results: list[Result] = []
    for place, name in enumerate(rank_drives(cards)):
        card, said = cards[name], sentences(cards[name])
        results.append(
            {
                "drive": name,
                "rank": place + 1,
                "outcome": "ok",
                "relative_std_percent": {p: 100.0 * std for p, std in card.relative_std.items()},
                "without_rig_uncertainty_percent": {p: 100.0 * std for p, std in card.known_exactly.items()},
                "friction_force_percent": 100.0 * card.friction_force,
                "overall_percent": 100.0 * card.overall,
                "stuck_percent": 100.0 * card.stuck,
                "correlation": card.correlation,
                "weakest_combination": {"weights": dict(card.weakest), "percent": 100.0 * card.weakest_std},
                **about,
                "message": "; ".join(said),
                "sentences": list(said),
            }
        )
    return tuple(results)


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    from estimation.card import percent
    from plant.eha import EhaParameters
    from plant.units import notes

    units = notes(EhaParameters)
    for result in results:
        shown = table("parameter", "least standard deviation [%]", title=_title(result, str(result["drive"])))
        for name, std in result["relative_std_percent"].items():
            shown.add_row(units[name].meaning, percent(0.01 * std).removesuffix(" %"))
        shown.add_row("friction force at the speed reached", percent(0.01 * result["friction_force_percent"])[:-2])
        yield shown
        yield from result["sentences"]


def _ranking(results: Sequence[Result]) -> "Iterable[RenderableType]":
    from estimation.card import percent

    names = list(results[0]["relative_std_percent"])
    headings = [f"{name.replace('_', ' ')} [%]" for name in names]
    shown = table("drive", "overall [%]", *headings, "stuck [%]", title=_title(results[0], "drives"))
    for result in results:
        values = [result["overall_percent"], *result["relative_std_percent"].values(), result["stuck_percent"]]
        shown.add_row(result["drive"], *(percent(0.01 * value).removesuffix(" %") for value in values))
    yield shown
    yield "overall is the geometric mean of the standard deviations; the drive that tells most comes first"
    yield f"{results[0]['drive']}: {results[0]['message']}" if results[0]["message"] else str(results[0]["drive"])


def _title(result: Result, what: str) -> str:
    return (
        f"{what}, {result['seconds']:g} s at {result['rate_hz']:g} Hz, {', '.join(result['sensors'])}, "
        f"condition {result['condition']}, rig {result['rig']}"
    )
