"""`hydrostate isolability`: predicts which faults an experiment can tell apart, before it is run."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.command.json_output import Result, prepare_output
from experiments.command.logs import Batch, finish
from experiments.command.options import SEED, Drive, Json, Noise, Out, Ranked, RigFile, Seed, load_rig, option
from experiments.command.terminal import table
from experiments.eha.identifiability import checked_experiment, experiment_inputs, results_by_drive, title_of

if TYPE_CHECKING:
    from rich.console import RenderableType

    from faults.eha.isolability import Distances
    from plant.eha.rig import Rig

commands = typer.Typer()


@commands.command(epilog="Example: hydrostate isolability --sensors position,velocity --drive prbs --seconds 10")
def isolability(
    sensors: Annotated[
        str, option("LIST", "Sensors besides motor speed, comma-separated: position, velocity, dp.")
    ] = "position,velocity,dp",
    noise: Noise = "bench",
    drive: Drive = "steps",
    seconds: Annotated[float, option("S", "Length of the experiment [s].", "--seconds", "--duration")] = 10.0,
    rate: Annotated[float, option("HZ", "Sample rate [Hz].")] = 1000.0,
    ranked: Ranked = False,
    rig: RigFile = None,
    out: Out = None,
    seed: Seed = SEED,
    as_json: Json = False,
) -> None:
    """Predict which faults an experiment can tell apart, before you run it.

    The first table is structural: which faults break the same balances for these sensors, whatever their time course.
    The second is the Kullback-Leibler distance per second between the nine conditions under the drive, where each
    condition is a class of actuators. The seed is that of random drives.
    """
    options = {"sensors": sensors, "noise": noise, "drive": drive, "seconds": seconds, "rate": rate, "ranked": ranked}
    channels = checked_experiment(options)
    bench = load_rig(rig)
    prepare_output(out)
    about = {"rig": bench.name, "sensors": list(channels), "noise": noise}
    about |= {"seconds": seconds, "rate_hz": rate, "seed": seed}
    found = results_by_drive(options, lambda name: _distances(name, bench, channels, about))
    results = tuple(_results(found, channels, about))
    finish(Batch(results, len(results)), _ranking if ranked else _screen, as_json=as_json, out=out)


def _distances(drive: str, bench: "Rig", channels: Mapping[str, str], about: Mapping[str, Any]) -> "Distances":
    from faults.eha.isolability import condition_distances

    speed, T, sensors = experiment_inputs(drive, bench.parameters, about)
    return condition_distances(bench.parameters, speed, T, tuple(channels.values()), sensors)


def _results(
    found: "Mapping[str, Distances]", channels: Mapping[str, str], about: Mapping[str, Any]
) -> Iterable[Result]:
    from faults.eha.isolability import structural_isolability, wrong_verdicts

    structure = structural_isolability(tuple(channels.values()))
    for rank, name in enumerate(sorted(found, key=lambda one: -found[one].least), 1):
        one = found[name]
        yield {
            "drive": name,
            "rank": rank,
            "outcome": "ok",
            "not_told_from": {fault: None if rivals is None else list(rivals) for fault, rivals in structure.items()},
            "conditions": list(one.conditions),
            "nats_per_second": one.nats / one.seconds,
            "nearest": {
                condition: {
                    "rival": one.conditions[int(row.argmin())],
                    "nats_per_second": float(row.min()) / one.seconds,
                    "wrong_verdicts_percent": 100.0 * wrong_verdicts(float(row.min())),
                }
                for condition, row in zip(one.conditions, one.mutual, strict=True)
            },
            "hardest_pair": list(one.hardest),
            "hardest_nats_per_second": one.least / one.seconds,
            **about,
            "message": _verdict(one),
        }


def _verdict(distances: "Distances") -> str:
    from faults.eha.isolability import ERROR, wrong_verdicts

    count = len(distances.conditions)
    apart = [distances.mutual[i, j] for i in range(count) for j in range(i)]
    alike = sum(wrong_verdicts(float(one)) > ERROR for one in apart)
    first, second = distances.hardest
    if not alike:
        return f"all conditions can be told apart; hardest are {first} and {second}, which need the longest log"
    return (
        f"{alike} of {len(apart)} pairs of conditions cannot be told apart with fewer than {100.0 * ERROR:g} % wrong "
        f"verdicts; the hardest pair is {first} and {second}"
    )


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    for result in results:
        structure = table("fault", "cannot be told from, whatever its time course", title=title_of(result, "structure"))
        for fault, rivals in result["not_told_from"].items():
            structure.add_row(fault, "not detectable" if rivals is None else ", ".join(rivals) or "told from all")
        yield structure
        headings = ("condition", "nearest rival", "distance [nats/s]", "least wrong verdicts [%]")
        shown = table(*headings, title=title_of(result, result["drive"]))
        for condition, near in result["nearest"].items():
            wrong = near["wrong_verdicts_percent"]
            said = "under 0.01" if wrong < 0.01 else f"{wrong:.2g}"
            shown.add_row(condition, near["rival"], f"{near['nats_per_second']:.3g}", said)
        yield shown
        yield str(result["message"])


def _ranking(results: Sequence[Result]) -> "Iterable[RenderableType]":
    shown = table("drive", "hardest pair", "distance [nats/s]", title=title_of(results[0], "drives"))
    for result in results:
        shown.add_row(result["drive"], " and ".join(result["hardest_pair"]), f"{result['hardest_nats_per_second']:.3g}")
    yield shown
    yield f"{results[0]['drive']} is the most informative: {results[0]['message']}"
