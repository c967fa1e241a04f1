"""`ActuatorKind`: what each kind of actuator provides; every verb, batch and page uses it (see docs/add-a-plant.md)."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from experiments.command.json_output import Result
from experiments.log_pages.entries import BLANK, finding_entries
from experiments.log_pages.screens import quantities_shown

if TYPE_CHECKING:
    from rich.console import RenderableType

    from estimation.finding import Finding
    from plant.eha.rig import Rig
    from plant.log.record import Record
    from plant.notes import Note

Options: TypeAlias = Mapping[str, Any]
"""Command line options by name, such as ``sample_time``; options not given have the kind's own defaults."""

Screen: TypeAlias = "Callable[[Sequence[Result], Options], Iterable[RenderableType]]"
"""Terminal output for the logs that did not fail."""


@dataclass(frozen=True, eq=False)
class Run:
    """A simulated log.

    Parameters
    ----------
    record : Record
        The log that the test bench would have recorded; its metadata say how it was made.
    about : Mapping[str, Any]
        The same for readers: condition, drive, sensors.
    """

    record: "Record"
    about: Mapping[str, Any] = field(default_factory=dict[str, Any])
    notes: "tuple[Note, ...]" = ()


@dataclass(frozen=True, kw_only=True)
class Simulation:
    """How `hydrostate simulate` runs a kind of actuator.

    Parameters
    ----------
    run : callable
        ``run(rig, options) -> Run``. ``options["seed"]`` is the seed of all that is random; ``options["plant"]`` is the
        name given by the user, one of `ActuatorKind.models` if the kind has several.
    options : Options
        The options that it accepts, with their defaults.
    """

    run: "Callable[[Rig[Any], Options], Run]"
    options: Options = field(default_factory=dict[str, Any])


@dataclass(frozen=True, kw_only=True)
class LogVerb:
    """How `hydrostate estimate` or `hydrostate diagnose` processes a log and shows its finding.

    Parameters
    ----------
    run : callable
        ``run(record, rig, options) -> Finding``, with rig and options as returned by `prepare`.
    run_beside : callable, optional
        ``run_beside(record, rig, options, kept) -> Finding``, the same for a log on which several verbs are run. Each
        verb stores results in the dictionary ``kept``, empty at first, for the others to start from.
    options : Options
        The options that it accepts, with their defaults. ``healthy`` is passed as a Record.
    prepare : callable
        ``prepare(rig, options) -> (rig, options)``, called once for all logs: rejects what cannot be used, and may copy
        what the options say about the actuator into the rig.
    entries : callable
        From a finding to its JSON entries, including ``outcome`` and ``message``.
    blank : Mapping[str, Any]
        The entries of a log that could not be used.
    page : callable, optional
        ``page(result, finding, record) -> HTML``; the page of `experiments.log_pages.finding_page` if not given.
    figure : callable, optional
        ``figure(finding, log's name, path)`` writes the figure of ``--figure``.
    remarks : callable
        Remarks on all results together, printed once on standard error.
    """

    run: "Callable[[Record, Rig[Any], Any], Finding]"
    run_beside: "Callable[[Record, Rig[Any], Any, dict[Any, Any]], Finding] | None" = None
    options: Options = field(default_factory=dict[str, Any])
    prepare: "Callable[[Rig[Any], Options], tuple[Rig[Any], Any]]" = lambda rig, options: (rig, options)
    entries: "Callable[[Finding], dict[str, Any]]" = finding_entries
    blank: Result = field(default_factory=BLANK.copy)
    screen: Screen = quantities_shown
    page: "Callable[[Result, Finding, Record], str] | None" = None
    figure: "Callable[[Finding, str, Path], None] | None" = None
    remarks: Callable[[Sequence[Result]], Iterable[str]] = lambda _: ()


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """How `hydrostate identifiability` evaluates an experiment.

    Parameters
    ----------
    run : callable
        ``run(rig, options) -> findings``: one for each experiment that was evaluated. Its quantities are the healthy
        values with the smallest standard deviation that any method could reach.
    options : Options
        The options that it accepts, with their defaults.
    """

    run: "Callable[[Rig[Any], Options], Sequence[Finding]]"
    options: Options = field(default_factory=dict[str, Any])
    entries: "Callable[[Finding], dict[str, Any]]" = finding_entries
    screen: Screen = quantities_shown


@dataclass(frozen=True, kw_only=True)
class ActuatorKind:
    """A kind of actuator. A verb that it does not offer is None.

    Parameters
    ----------
    name : str
        Its name in ``--plant`` and in rig files.
    parameters : type
        Frozen dataclass of its parameters: every field has an `SI` note and a default, the healthy actuator's.
    channels : Mapping[str, str]
        Unit of every channel that a log may contain, by name.
    required : tuple of str
        Channels that a log must contain; ``"position_m or velocity_m_s"`` requires one of the two.
    conditions : tuple of str
        Conditions that a diagnosis may name, the healthy actuator first.
    models : tuple of str
        Names of its models, if `simulate` has several; the kind's own name if empty.
    rig_name : str
        Name of the default rig.
    simulate : Simulation or None
        Simulation of runs, including faults.
    estimate, diagnose : LogVerb or None
        Verbs that analyse a log.
    identifiability : Experiment or None
        Prediction of what an experiment would determine.
    """

    name: str
    description: str
    parameters: type[Any]
    channels: Mapping[str, str]
    required: tuple[str, ...]
    conditions: tuple[str, ...] = ()
    models: tuple[str, ...] = ()
    rig_name: str = "default"
    simulate: Simulation | None = None
    estimate: LogVerb | None = None
    diagnose: LogVerb | None = None
    identifiability: Experiment | None = None

    @property
    def rig(self) -> "Rig[Any]":
        """The healthy actuator with default parameters."""
        from plant.eha.rig import Rig

        return Rig(self.rig_name, self.parameters())

    def read_rig(self, path: Path | None) -> "Rig[Any]":
        """Return the rig from a file; without a file, the default rig.

        Raises
        ------
        RigError
            If the file is not usable, or is of another kind of actuator.
        """
        from plant.eha.rig import read_rig

        return self.rig if path is None else read_rig(path, self.parameters, self.name)
