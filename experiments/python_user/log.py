"""A log for Python users: its channels, and the verbs that analyse it."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from math import inf, isfinite
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any

from experiments.python_user.answers import Answer, Model, Shown, names_of, refuse
from experiments.python_user.options import known_options
from experiments.python_user.python_words import options_by_name
from experiments.python_user.words_of_answer import Words

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from matplotlib.axes import Axes

    from estimation.finding import Finding
    from experiments.actuator_kind import LogVerb
    from experiments.python_user.relation import Relation
    from plant.eha.rig import Rig
    from plant.errors import LogWarning
    from plant.log.record import Record


ANY = "anything"
"""Kind of a log whose columns are not those of an actuator: its channels can be related, but nothing can be
diagnosed."""


FREE_OPTIONS = ("input", "output", "structure", "order", "delay", "n_numerator", "sample_time", "reference")
"""Options of `Log.identify` between any channels."""


WHOLE = ("order", "delay", "n_numerator")
"""Those options that must be whole numbers, if given."""


class Log(Shown):
    """A log of one actuator."""

    def __init__(
        self,
        record: "Record",
        rig: "Rig[Any]",
        plant: str = "eha",
        said: "Sequence[LogWarning]" = (),
        *,
        sparse: "Record | None" = None,
        refusal: str = "",
        name: str = "log",
    ) -> None:
        import warnings

        from plant.eha.rig import Rig
        from plant.log.record import Record, with_samples

        if not isinstance(record, Record):  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
            refuse(f"a Log is made of a Record, got {type(record).__name__}; hydrostate.read opens files and tables")
        if not isinstance(rig, Rig):  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
            refuse(f"the rig of a Log must be a Rig, got {type(rig).__name__}; hydrostate.read_rig reads one")
        record, empty = with_samples(record)
        for one in empty:
            warnings.warn(one, stacklevel=2)
        self.record, self.rig, self.plant, self._said = record, rig, plant, (*said, *empty)
        self._sparse, self._refusal, self._name = sparse, refusal, name
        self._kept: tuple[Record, dict[Any, Any]] = record, {}

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_kept": (self.record, {})}  # copies share no intermediate results

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(self.record)

    @property
    def sample_time(self) -> float:
        """Time between samples [s]."""
        return self.record.sample_time

    @property
    def duration(self) -> float:
        """Length of the log [s]."""
        return self.record.duration

    def __getitem__(self, channel: str | slice) -> "np.ndarray[Any, Any]":
        if isinstance(channel, slice):
            refuse("a log takes the name of a channel, got a slice; between(begin, end) takes a part [s]")
        return self.record[channel]

    def __iter__(self) -> Iterator[str]:
        return iter(self.record)

    def __len__(self) -> int:
        return len(self.record)

    def __getattr__(self, name: str) -> Any:
        if name in self.__dict__.get("record", ()):
            from plant.errors import NoSuchNameError

            raise NoSuchNameError(f"Log has no attribute {name!r}; log[{name!r}] is that channel")
        return super().__getattr__(name)

    def __str__(self) -> str:
        said = f"Log of {self.plant}: {self.duration:g} s at {1.0 / self.sample_time:g} Hz"
        about = "" if self.plant == ANY else f"; rig {self.rig.name!r}"
        return f"{said}, {', '.join(self.channels)}{about}"

    def _repr_html_(self) -> str:
        from html import escape

        table = self.to_frame().agg(["min", "max"]).T.to_html(float_format="{:.5g}".format)
        return f"<p>{escape(str(self))}</p>{table}"

    def between(self, begin: float, end: float) -> "Log":
        """Return a part of the log.

        Parameters
        ----------
        begin, end : float
            Start and end of the part [s].

        Raises
        ------
        HydrostateError
            If the part has too few samples to be a log.
        """
        from plant.log.clock.uniform import FEWEST_SAMPLES

        if not all(isinstance(one, Real) for one in (begin, end)):  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
            refuse(f"begin and end of a part must be seconds, got {begin!r} and {end!r}")
        start = self.record.start_time
        until = min(end, start + self.duration + self.sample_time)
        first, last = (round((at - start) / self.sample_time) if isfinite(at) else -1 for at in (begin, until))
        if first < 0 or not begin < end:
            refuse(f"a part of the log is needed from an earlier to a later time, got {begin:g} s to {end:g} s")
        span = first, last + 1
        if (count := max(0, min(last + 1, len(self)) - first)) < FEWEST_SAMPLES:
            ends = f"{self.record.start_time:g} to {self.record.start_time + self.duration:g} s"
            refuse(
                f"a part of at least {FEWEST_SAMPLES} samples is needed, {begin:g} s to {end:g} s has {count} of the "
                f"log's, which is from {ends}"
            )
        sparse = self._sparse
        if sparse is not None:  # it may begin earlier, if a channel begins late
            ahead = round((self.record.start_time - sparse.start_time) / self.sample_time)
            sparse = sparse.slice(first + ahead, last + 1 + ahead)
        kept: dict[str, Any] = {"sparse": sparse, "refusal": self._refusal, "name": self._name}
        return Log(self.record.slice(*span), self.rig, self.plant, self._said, **kept)

    def whole(self) -> "Record":
        """Return the record, if few enough of its samples are missing to estimate an actuator.

        Raises
        ------
        LogError
            If over 5 % of the samples were missing in the log that was read.
        """
        from plant.errors import SparseLogError

        if self._refusal:
            raise SparseLogError(self._refusal)
        return self.record

    @property
    def related(self) -> "Record":
        """The record whose channels `identify` relates; up to half of a channel may be missing."""
        return self.record if self._sparse is None else self._sparse

    def estimate(self, **options: Any) -> "Answer":
        """Estimate what cannot be measured: effective bulk modulus, leakage, and more for some kinds of actuator.

        Parameters
        ----------
        **options
            Options of `hydrostate estimate`, such as ``method="ekf"``, ``no_pressure=True``.

        Returns
        -------
        Answer
            Quantities with 95 % intervals, and whether to believe them.
        """
        return self._asked("estimate", options)

    def diagnose(self, **options: Any) -> "Answer":
        """Find what is wrong: which condition, how probable, how severe, or that none of them fits.

        Parameters
        ----------
        **options
            Options of `hydrostate diagnose`, such as ``no_pressure=True``.

        Returns
        -------
        Answer
            Condition, probabilities, severities with 95 % intervals, and whether to believe them.
        """
        return self._asked("diagnose", options)

    def identify(self, *logs: "Log", **options: Any) -> "Model | Relation":
        """Identify a transfer function from motor speed to velocity, or the relation between any channels.

        Parameters
        ----------
        *logs : Log
            Further experiments, if ``input`` and ``output`` are given.
        **options
            With ``input`` and ``output``, names or lists of them: ``structure`` ("output-error", "narx", "hammerstein",
            "wiener", "state-space", "auto"), ``order``, ``delay``, ``n_numerator``, ``sample_time`` [s], ``reference``
            (columns that drive a closed loop from outside); the data choose what is not given. Without these two, as
            `estimation.identification.from_record.identify_record` takes them: ``n_denominator=3``.

        Returns
        -------
        Model or Relation
            The transfer function with its uncertainty, or one model for each output.
        """
        import inspect

        from estimation.identification.from_record import identify_record
        from experiments.python_user.own_page import page_of_channels

        known = {name: one.default for name, one in inspect.signature(identify_record).parameters.items()}
        del known["record"]
        free: dict[str, Any] = dict.fromkeys(FREE_OPTIONS)
        if self.plant == ANY or logs or (options.keys() & {"input", "output"} and options.keys() <= free.keys()):
            known_options(options, free, "identify")
            clock = options.get("sample_time")
            if clock is not None and not (isinstance(clock, Real) and 0.0 < float(clock) < inf):
                refuse(f"sample_time must be a number of seconds above 0, got {clock!r:.80}")
            for name in WHOLE:
                if not isinstance(options.get(name), Integral | None) or isinstance(options.get(name), bool):
                    refuse(f"{name} must be a whole number, got {options[name]!r}")
            return self._relation([self, *logs], dict(options))
        record, asked = self.whole(), known_options(options, known, "identify")
        model = identify_record(record, **asked)
        return Model(model, partial(page_of_channels, record, model, asked))

    def _relation(self, logs: "list[Log]", options: dict[str, Any]) -> "Relation":
        from experiments.python_user.relation import identified

        if not {"input", "output"} <= options.keys():
            refuse(f"input=NAME and output=NAME are needed, channels among {', '.join(self.channels)}")
        inputs, outputs = options.pop("input"), options.pop("output")
        asked = {"input": inputs, "output": outputs, "reference": options.get("reference") or ()}
        names = [name for option, given in asked.items() for name in names_of(option, given)]
        for one in logs:
            one._tell_sparse(names)
        return identified([one.related for one in logs], inputs, outputs, options)

    def _tell_sparse(self, asked: "Sequence[str]") -> None:
        """Warn about channels with too many missing samples for the record; their remaining samples are used here."""
        import warnings

        import numpy as np

        from plant.errors import LogWarning
        from plant.log.notes import LogCode

        for name in asked:
            if name not in self.record and name in self.related:
                count, total = int(np.isnan(self.related[name]).sum()), len(self)
                said = LogCode.SAMPLES_MASKED.note(
                    channel=name, count=count, total=total, percent=100.0 * count / total
                )
                warnings.warn(LogWarning(said), stacklevel=4)

    def _asked(self, verb: str, options: Mapping[str, Any]) -> "Answer":
        from experiments.actuators import actuator, verb_of_kind

        if self.plant == ANY:
            from plant.log.checks import REQUIRED, alternatives
            from plant.log.guess import SHOWN_PROBABILITY, guess_by_name
            from plant.log.headings import headings_of

            sure = [one for one in guess_by_name(headings_of(self.channels)) if one.sure >= SHOWN_PROBABILITY]
            meant = {one.channel: one.spec if one.unit else f"{one.spec}:UNIT" for one in sure}
            if not any(name in meant for one in REQUIRED for name in alternatives(one)):
                meant = {"motor_speed_rad_s": "N:rpm"}  # only channels that the verb needs are useful examples
            refuse(
                f"{verb} needs {' and '.join(REQUIRED)}, the log has {', '.join(self.channels)}: name them by "
                f"read(..., columns={meant}), or relate them by "
                "identify(input=..., output=...)"
            )
        record, chosen = self.whole(), verb_of_kind(actuator(self.plant), verb)
        asked = {**chosen.options, **known_options(options, chosen.options, verb)}
        if isinstance(asked.get("healthy"), Log):
            asked["healthy"] = asked["healthy"].whole()
        with options_by_name():
            rig, prepared = chosen.prepare(self.rig, {**asked, "seed": 2024})
            found = self._found(chosen, record, rig, prepared)
        entries = {**chosen.blank, **chosen.entries(found)}

        words = Words(self.plant, verb, asked, rig, record, self._said)
        return Answer(found, entries, words.screen, partial(words.page, found, entries), self._name)

    def _found(self, chosen: "LogVerb", record: "Record", rig: "Rig[Any]", prepared: Any) -> "Finding":
        """Return the finding of a verb, reusing results that another verb has cached for this log."""
        if chosen.run_beside is None:
            return chosen.run(record, rig, prepared)
        if self._kept[0] is not record:
            self._kept = record, {}
        return chosen.run_beside(record, rig, prepared, self._kept[1])

    def to_frame(self) -> "pd.DataFrame":
        """Return the channels as a table.

        Returns
        -------
        pandas.DataFrame
            One row per sample, by time [s]; one column per channel, in SI.
        """
        import pandas as pd

        return pd.DataFrame(dict(self.record.channels), index=pd.Index(self.record.time, name="time_s"))

    def plot(self) -> "list[Axes]":
        """Draw every channel over time, in SI."""
        import matplotlib.pyplot as plt

        from experiments.log_pages.channel_charts import label_of

        count = len(self.channels)
        _, axes = plt.subplots(count, 1, sharex=True, squeeze=False, figsize=(8.0, 1.8 * count))
        for axis, name in zip(axes[:, 0], self.channels, strict=True):
            axis.plot(self.record.time, self.record[name], lw=0.8)
            axis.set_ylabel(label_of(name), fontsize=8)
        axes[0, 0].set_title(str(self))
        axes[-1, 0].set_xlabel("time [s]")
        return list(axes[:, 0])
