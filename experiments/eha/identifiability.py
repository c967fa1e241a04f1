"""Identifiability of an experiment on the gear-pump actuator, before it is run."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from experiments.command.json_output import Result
from experiments.command.options import PRESSURE, require_positive
from experiments.command.terminal import note, table
from plant.errors import DriveError, HydrostateError, require_known

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from rich.console import RenderableType

    from estimation.finding import Finding
    from estimation.trust.card import Card
    from plant.eha.model import EhaParameters
    from plant.eha.rig import Rig
    from plant.sensors.sensors import Sensors

T = TypeVar("T")

CHANNELS: Mapping[str, str] = {"position": "position_m", "velocity": "velocity_m_s", "dp": PRESSURE}
"""Names of the channels in ``--sensors``."""

MOST_SAMPLES = 2_000_000
"""Maximum number of samples in an experiment."""


class ExperimentCard(NamedTuple):
    """An experiment with its card: the evidence of a finding.

    Parameters
    ----------
    rank : int
        Rank among the examined experiments, from 1.
    about : Mapping[str, Any]
        Further entries on the experiment.
    """

    drive: str
    rank: int
    card: "Card"
    about: Mapping[str, Any]


def cards_of(rig: "Rig[Any]", options: Mapping[str, Any]) -> "list[Finding]":
    """Examine one experiment, or all drives, the most informative first.

    Returns
    -------
    list of Finding
        One finding for each experiment, with an `ExperimentCard` as evidence.

    Raises
    ------
    HydrostateError
        If an option is not usable, or no drive is within the actuator's limits.
    """
    from estimation.finding import Finding, Gate, Outcome, Quantity
    from estimation.trust.card import rank_drives
    from faults.conditions import find_condition, parameters_for
    from plant.units import notes

    channels = checked_experiment(options)
    chosen = find_condition(options["condition"] or "normal")
    parameters = parameters_for(chosen, rig.parameters)
    about = {"condition": chosen.name, "rig": rig.name, "sensors": list(channels), "noise": options["noise"]}
    about |= {"seconds": options["seconds"], "rate_hz": options["rate"], "seed": options["seed"]}
    cards = results_by_drive(options, lambda name: _card(name, parameters, rig, channels, about))
    units = notes(type(parameters))
    return [
        Finding(
            actuator="eha",
            outcome=Outcome.OK,
            quantities={
                p: Quantity(getattr(parameters, p), units[p].unit, None, std * abs(getattr(parameters, p)))
                for p, std in cards[name].relative_std.items()
            },
            gate=Gate(True, ()),
            channels=cards[name].channels,
            evidence=ExperimentCard(name, place + 1, cards[name], about),
        )
        for place, name in enumerate(rank_drives(cards))
    ]


def checked_experiment(options: Mapping[str, Any]) -> dict[str, str]:
    """Return the channels of an experiment, after checking its options.

    Parameters
    ----------
    options : Mapping[str, Any]
        ``sensors``, ``noise``, ``drive``, ``seconds`` and ``rate``.

    Raises
    ------
    HydrostateError
        If one is not usable.
    """
    from plant.eha.drives import DRIVES
    from plant.sensors.sensors import SENSORS

    channels = sensed_channels(options["sensors"])
    seconds, rate = options["seconds"], options["rate"]
    require_known("--noise", options["noise"], [name for name in SENSORS if name != "ideal"])
    require_known("--drive", options["drive"], list(DRIVES))
    require_positive("--seconds (--duration)", seconds, "s")
    require_positive("--rate", rate, "Hz")
    if not 2.0 <= seconds * rate <= MOST_SAMPLES:
        raise HydrostateError(f"--seconds times --rate must be 2 to {MOST_SAMPLES} samples, got {seconds * rate:g}")
    return channels


def results_by_drive(options: Mapping[str, Any], look: Callable[[str], T]) -> dict[str, T]:
    """Return the result of `look` for one drive, or for each drive within the actuator's limits.

    Parameters
    ----------
    options : Mapping[str, Any]
        ``drive``, and ``ranked`` for all drives.
    look : callable
        Function from a drive's name to its result.

    Returns
    -------
    dict[str, object]
        Results by drive.

    Raises
    ------
    HydrostateError
        If no drive is within its limits.
    """
    from plant.eha.drives import DRIVES

    found: dict[str, T] = {}
    for name in DRIVES if options["ranked"] else [options["drive"]]:
        try:
            found[name] = look(name)
        except DriveError as error:
            if not options["ranked"]:
                raise
            note(f"{name} is left out: {error}")
    if not found:
        raise HydrostateError("no drive is within this actuator's limits")
    return found


def sensed_channels(listed: str) -> dict[str, str]:
    """Return the channels of ``--sensors``, in their usual order.

    Parameters
    ----------
    listed : str
        Names in `CHANNELS`, separated by commas.

    Raises
    ------
    HydrostateError
        If a name is unknown or comes twice.
    """
    given = [name.strip() for name in listed.split(",")]
    for i, name in enumerate(given):
        require_known("--sensors", name, list(CHANNELS))
        if name in given[:i]:
            raise HydrostateError(f"--sensors names {name} twice")
    return {name: channel for name, channel in CHANNELS.items() if name in given}


def _card(
    drive: str, parameters: "EhaParameters", rig: "Rig[Any]", channels: Mapping[str, str], about: Mapping[str, Any]
) -> "Card":
    from estimation.trust.identifiability import identifiability_card

    speed, sample_time, sensors = experiment_inputs(drive, parameters, about)
    measured, known = tuple(channels.values()), rig.uncertainties
    return identifiability_card(parameters, speed, sample_time, measured, sensors=sensors, uncertainties=known)


def experiment_inputs(
    drive: str, parameters: "EhaParameters", about: Mapping[str, Any]
) -> "tuple[NDArray[np.float64], float, Sensors]":
    """Return motor speed [rad/s], shape (n,), the sample time [s], and the sensors of an experiment."""
    import numpy as np

    from plant.eha.drives import make_drive
    from plant.sensors.sensors import SENSORS

    T = 1.0 / about["rate_hz"]
    speed = make_drive(drive, about["seconds"], T, parameters, np.random.default_rng(about["seed"]))
    return speed, T, SENSORS[about["noise"]]


def experiment_entries(found: "Finding") -> dict[str, Any]:
    """Return the identifiability of an experiment, for JSON."""
    from estimation.trust.card import sentences

    drive, rank, card, about = found.evidence
    said = sentences(card)
    return {
        "drive": drive,
        "rank": rank,
        "outcome": found.outcome.value,
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


def experiments_shown(results: Sequence[Result], options: Mapping[str, Any]) -> "Iterable[RenderableType]":
    """Show what an experiment can determine, or the ranking of drives.

    Parameters
    ----------
    options : Mapping[str, Any]
        Options of the verb; ``ranked`` selects the ranking.
    """
    return _ranking(results) if options["ranked"] else _screen(results)


def _screen(results: Sequence[Result]) -> "Iterable[RenderableType]":
    from estimation.trust.card import percent
    from plant.eha.model import EhaParameters
    from plant.units import notes

    units = notes(EhaParameters)
    for result in results:
        shown = table("parameter", "least standard deviation [%]", title=title_of(result, str(result["drive"])))
        for name, std in result["relative_std_percent"].items():
            shown.add_row(units[name].meaning, percent(0.01 * std).removesuffix(" %"))
        shown.add_row("friction force at the speed reached", percent(0.01 * result["friction_force_percent"])[:-2])
        yield shown
        yield from result["sentences"]


def _ranking(results: Sequence[Result]) -> "Iterable[RenderableType]":
    from estimation.trust.card import percent
    from plant.eha.model import EhaParameters
    from plant.units import notes

    headings = [f"{notes(EhaParameters)[name].meaning} [%]" for name in results[0]["relative_std_percent"]]
    shown = table("drive", "overall [%]", *headings, "stuck [%]", title=title_of(results[0], "drives"))
    for result in results:
        values = [result["overall_percent"], *result["relative_std_percent"].values(), result["stuck_percent"]]
        shown.add_row(result["drive"], *(percent(0.01 * value).removesuffix(" %") for value in values))
    yield shown
    yield "overall: geometric mean of the standard deviations; the most informative drive is first"
    yield f"{results[0]['drive']}: {results[0]['message']}" if results[0]["message"] else str(results[0]["drive"])


def title_of(result: Result, what: str) -> str:
    """Return the title of an experiment's table."""
    condition = f"condition {result['condition']}, " if "condition" in result else ""
    sensors = ", ".join(result["sensors"])
    return f"{what}, {result['seconds']:g} s at {result['rate_hz']:g} Hz, {sensors}, {condition}rig {result['rig']}"
