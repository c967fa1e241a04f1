"""The cases of a study: each series and the methods applied to it. The key of a case is a hash of its content."""

import hashlib
import json
from collections.abc import Collection, Iterator, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cache, cached_property, partial
from importlib.metadata import version
from itertools import product
from math import prod
from pathlib import Path
from typing import Any, TypeAlias

from estimation.engine.kernels import LANES
from experiments.actuators import DEFAULT, actuator, read_own_rig
from experiments.batch.logs_listed import listed_logs
from experiments.batch.other_actuators import simulated_series
from experiments.batch.series import Group, Log, Series, Simulated, Work
from experiments.batch.study_file import Method, Runs, Study, StudyError
from faults.conditions import CONDITIONS, LEVELS
from plant.eha.rig import Rig

Hash: TypeAlias = Any
"""A hash object in progress; the standard library does not name its type."""

RESULTS_VERSION = 3
"""Increase this when results change for a reason that the content of a case does not show; older rows are then
remade."""

TASK_SECONDS = 2.0
"""Approximate duration of one worker task [s]: the most work that a crash can lose, and the size of a part."""

MOST_SERIES = 1_000_000
"""Maximum number of series in one `[[runs]]` [count]; all are listed before the first is run."""

MOST_CASES = 2048
"""Maximum number of cases in a task, however short they are [count]; chosen by judgement."""

COSTS: Mapping[str, tuple[float, float]] = {"filter": (0.0, 2.5e-8), "estimate": (0.3, 2e-5), "diagnose": (0.05, 1e-6)}
"""Approximate cost of a case on one core, by verb: fixed, and for each tenth of a millisecond of its series [s]."""

SERIES_COST = 4e-7
"""Approximate one-off cost of simulating or reading a tenth of a millisecond of a series [s]."""


@dataclass(frozen=True)
class Task:
    """Work for one worker: some series with their cases."""

    rig: Rig[Any]
    groups: tuple[Group, ...]
    plant: str = DEFAULT
    rigs: Mapping[str, Rig[Any]] = field(default_factory=dict[str, Rig[Any]])

    def rig_of(self, series: Series) -> Rig[Any]:
        """Return the rig of a series: that of a log's folder, if it has one, else the study's."""
        return _rig_of(series, self.rig, self.rigs)

    @property
    def keys(self) -> list[str]:
        """The keys of its cases, in order."""
        return [key for group in self.groups for key in group.keys]


@dataclass(frozen=True)
class Plan:
    """All cases of a study.

    Parameters
    ----------
    blocks : tuple
        Blocks of series, each with the works to do on every series in it.
    rigs : Mapping[str, Rig]
        Rigs of the folders that have their own.
    links : Mapping[str, str]
        Alternative names of logs, each with the name under which the log is counted.
    """

    study: Study
    rig: Rig[Any]
    blocks: tuple[tuple[tuple[Series, ...], tuple[Work, ...]], ...]
    rigs: Mapping[str, Rig[Any]] = field(default_factory=dict[str, Rig[Any]])
    links: Mapping[str, str] = field(default_factory=dict[str, str])

    def __len__(self) -> int:
        return sum(len(series) * len(works) for series, works in self.blocks)

    @property
    def seconds(self) -> float:
        """Approximate time for all cases on one core [s]."""
        return sum(_seconds(sum(map(_steps, series)), len(series), works) for series, works in self.blocks)

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """Every series with its cases, in the study's order."""
        plant = [] if self.study.plant == DEFAULT else [self.study.plant]
        common = _hash([RESULTS_VERSION, package_version("hydrostate"), _numbers(self.rig), *plant])
        out: list[Group] = []
        for series, works in self.blocks:
            encoded = [_bytes(asdict(work)) for work in works]
            for one in series:
                own = self.rigs.get(one.folder) if isinstance(one, Log) else None
                begun = _hash(_content(one) if own is None else [*_content(one), _numbers(own)], common)
                out.append(Group(one, tuple([_key(begun, text) for text in encoded]), works))
        return tuple(out)

    @cached_property
    def keys(self) -> list[str]:
        """The keys of all cases, in the study's order; a case that is named twice counts once."""
        return list(dict.fromkeys(key for group in self.groups for key in group.keys))

    def tasks(self, done: Collection[str], workers: int) -> Iterator[Task]:
        """Yield the remaining work in pieces of about `TASK_SECONDS`, or less if workers would otherwise be idle.

        Parameters
        ----------
        done : collection of str
            Keys of the cases that need not be run.
        """
        seen = set(done)
        gathered = _TaskBuilder(min(TASK_SECONDS, self.seconds / (2.0 * workers)))
        for group in self.groups:
            left = _remaining_cases(group, seen)
            if not left.keys:
                continue
            seen.update(left.keys)
            if gathered.groups and gathered.ends_before(left):
                yield self._task(gathered)
                gathered = _TaskBuilder(gathered.budget)
            gathered.add(left)
        if gathered.groups:
            yield self._task(gathered)

    def _task(self, gathered: "_TaskBuilder") -> Task:
        return Task(self.rig, tuple(gathered.groups), self.study.plant, self.rigs)

    def rig_of(self, series: Series) -> Rig[Any]:
        """Return the rig of a series: that of a log's folder, if it has one, else the study's."""
        return _rig_of(series, self.rig, self.rigs)


def _rig_of(series: Series, rig: Rig[Any], rigs: Mapping[str, Rig[Any]]) -> Rig[Any]:
    return rigs.get(series.folder, rig) if isinstance(series, Log) else rig


def _remaining_cases(group: Group, done: Collection[str]) -> Group:
    """Return the cases of a group that are not done."""
    left = [place for place, key in enumerate(group.keys) if key not in done]
    if len(left) == len(group.keys):
        return group
    return Group(group.series, tuple(group.keys[place] for place in left), tuple(group.works[place] for place in left))


@dataclass(eq=False)
class _TaskBuilder:
    """Cases gathered for a task of about a given duration; the task ends where a cut costs least.

    A cut costs least when the lanes of the filters are full, or between two simulated motions, so that none is
    simulated twice.
    """

    budget: float
    groups: list[Group] = field(default_factory=list[Group])
    spent: float = 0.0
    count: int = 0
    filters: int = 0

    def add(self, group: Group) -> None:
        self.groups.append(group)
        self.spent += _seconds(_steps(group.series), 1, group.works)
        self.count += len(group.keys)
        self.filters += sum(work.verb == "filter" for work in group.works)

    def ends_before(self, group: Group) -> bool:
        if self.count + len(group.keys) > MOST_CASES:
            return True
        if self.spent >= (self.budget if self.filters % LANES == 0 else 2.0 * self.budget):
            return True
        return self.spent >= 0.5 * self.budget and _motion(group.series) != _motion(self.groups[-1].series)


def plan_study(study: Study, folder: Path) -> Plan:
    """List the cases of a study; logs are hashed, nothing is run.

    Raises
    ------
    StudyError
        If a glob finds no log, or there are more than a million series.
    RigError
        If the rig file is not usable.
    """
    for place, one in enumerate(study.runs):
        if (count := _count(one)) > MOST_SERIES:
            raise StudyError(f"runs[{place}] must be at most {MOST_SERIES:,} series, got up to {count:,}: lower seeds")
    kind = actuator(study.plant)
    rig = kind.read_rig(folder / study.rig if study.rig else None)
    rigs = {name: read_own_rig(folder / file, kind) for name, file in study.rigs.items()}
    listed = _simulated_series if kind.name == DEFAULT else partial(simulated_series, kind)
    logs = [listed_logs(one, place, folder, rigs) for place, one in enumerate(study.logs)]
    series = [*map(listed, study.runs), *(one.logs for one in logs)]
    works = [_works(one.methods, one.starts_pa) for one in (*study.runs, *study.logs)]
    links = {name: counted for one in logs for name, counted in one.links.items()}
    return Plan(study, rig, tuple(zip(map(tuple, series), works, strict=True)), rigs, links)


def _count(runs: Runs) -> int:
    """Return an upper bound on the number of series, before any is listed."""
    named = len(runs.conditions) if runs.conditions is not None else 0 if runs.severities else len(CONDITIONS)
    each = prod(max(1, len(some)) for some in (runs.plants, runs.drives, runs.sensors))
    return each * (named + len(runs.severities)) * runs.seed_count


@cache
def package_version(name: str) -> str:
    """Return the version of an installed package; looking it up takes milliseconds."""
    return version(name)


def config_hash(study: Study, rig: Rig[Any], rigs: Mapping[str, Rig[Any]]) -> str:
    """Return a hash of a study's content and of its rigs.

    Parameters
    ----------
    rigs : Mapping[str, Rig]
        Rigs of the folders that have their own.

    Returns
    -------
    str
        32 hexadecimal digits.
    """
    told = study.model_dump(mode="json", exclude=None if rigs else {"rigs"})
    return _hash([told, _numbers(rig), *map(_numbers, rigs.values())]).hexdigest()[:32]


def _simulated_series(runs: Runs) -> Iterator[Simulated]:
    """Yield the series with seeds in the innermost loop, so that what seeds share is computed once."""
    names = runs.conditions if runs.conditions is not None else (() if runs.severities else tuple(CONDITIONS))
    found = [CONDITIONS[name] for name in names]
    places = [(one.name, float(LEVELS.index(one.leakage)), float(LEVELS.index(one.friction))) for one in found]
    places += [(None, leakage, friction) for leakage, friction in runs.severities]
    axes = product(runs.plants, runs.drives, runs.sensors, places, runs.seed_list)
    for plant, drive, sensors, (name, leakage, friction), seed in axes:
        yield Simulated(plant, drive, sensors, name, leakage, friction, seed, runs.duration_s, runs.sample_time_s)


def _works(methods: tuple[Method, ...], starts: tuple[float, ...]) -> tuple[Work, ...]:
    return tuple(
        Work(one.verb, one.form, one.method, one.pressure, one.told, start, one.start_std_pa)
        for one in methods
        for start in ((None,) if one.verb == "diagnose" or not starts else starts)
    )


def _content(series: Series) -> list[Any]:
    """Return the identity of a series; the folder of a log is not part of it."""
    if isinstance(series, Log):
        given = [] if series.sample_time_s is None else [series.sample_time_s]  # keys of older stores stay valid
        return ["log", series.file, series.content, series.columns, *given]
    return ["simulated", *(getattr(series, one.name) for one in fields(series))]


def _numbers(rig: Rig[Any]) -> list[Any]:
    return [asdict(rig.parameters), dict(rig.uncertainties), dict(rig.columns), sorted(rig.measured)]


def _motion(series: Series) -> Series | None:
    """Return the key that all series with the same motion share; None for logs."""
    return replace(series, condition=None, seed=0, sensors="") if isinstance(series, Simulated) else None


def _steps(series: Series) -> float:
    """Return the approximate length of a series in tenths of a millisecond, at least one for each sample."""
    if isinstance(series, Simulated):
        return series.samples * max(1.0, series.sample_time_s / 1e-4)
    return float(series.samples)


def _seconds(steps: float, series: int, works: Collection[Work]) -> float:
    """Return the approximate total time of a number of series on one core [s]."""
    each = [COSTS[work.verb] for work in works]
    return steps * (SERIES_COST + sum(step for _, step in each)) + series * sum(alone for alone, _ in each)


def _bytes(content: object) -> bytes:
    return json.dumps(content, sort_keys=True, separators=(",", ":")).encode()


def _hash(content: object, begun: Hash | None = None) -> Hash:
    digest = hashlib.sha256() if begun is None else begun.copy()
    digest.update(_bytes(content))
    return digest


def _key(begun: Hash, text: bytes) -> str:
    digest = begun.copy()
    digest.update(text)
    return digest.hexdigest()[:32]
