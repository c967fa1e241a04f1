"""A model between any channels for Python users: it can be printed, drawn, simulated, tested and saved."""

import warnings
from collections.abc import Mapping, Sequence
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.python_user.answers import Shown, names_of, refuse
from plant.errors import LogWarning

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from control import StateSpace, TransferFunction
    from matplotlib.axes import Axes

    from estimation.identification.free_run.data import Channels
    from estimation.identification.free_run.model import FreeRunModel
    from estimation.identification.free_run.quality import FreeRun
    from estimation.identification.state_space.dynamics import StateSpaceDynamics
    from plant.log.record import Record

_FIVE = "{:.5g}".format


class Relation(Shown):
    """Models with the same inputs, one for each output.

    Parameters
    ----------
    models : sequence of FreeRunModel
        One for each output.
    entries : sequence of Mapping
        Results for each model by the names of the JSON contract; empty for loaded models.
    data : sequence of Channels
        The fitted logs, for each model; empty for loaded models.
    expected : sequence of float
        `Identified.expected_error` of each model; empty for loaded models [dimensionless].
    """

    def __init__(
        self,
        models: "Sequence[FreeRunModel]",
        entries: "Sequence[Mapping[str, Any]]" = (),
        data: "Sequence[Channels]" = (),
        expected: Sequence[float] = (),
    ) -> None:
        self.models, self._entries, self._data = tuple(models), tuple(entries), tuple(data)
        self._expected = tuple(expected) or (nan,) * len(self.models)

    def __getattr__(self, name: str) -> Any:
        if not name.startswith("_") and len(self.models) == 1:
            if self._entries and name in self._entries[0]:
                return self._entries[0][name]
            if hasattr(self.models[0], name):
                return getattr(self.models[0], name)
        return super().__getattr__(name)

    def __dir__(self) -> list[str]:
        own = {*super().__dir__()}
        if len(self.models) == 1:
            own |= {*dict(*self._entries[:1]), *(one for one in dir(self.models[0]) if not one.startswith("_"))}
        return sorted(own)

    def __str__(self) -> str:
        return f"From {', '.join(self.models[0].inputs)}\n{self.to_frame().to_string(float_format=_FIVE)}"

    def _repr_html_(self) -> str:
        return self.to_frame().to_html(float_format=_FIVE)

    def simulate(self, log: Any) -> "np.ndarray[Any, Any]":
        """Return the free run on a log; the initial state is taken from the measured output if there is one.

        Parameters
        ----------
        log : Log, Record, table, or array_like of shape (n, m) or (n,)
            A log with the model's channels, or a table in a form that `hydrostate.read` takes, whose columns are found
            by name. Or an array of the inputs alone, in the model's order and at its sample time.

        Returns
        -------
        ndarray, shape (n,), or (n, outputs)
            Simulated output, at the model's sample time.

        Raises
        ------
        HydrostateError
            If an input is missing or is not finite.

        Warns
        -----
        LogWarning
            If a linear model is run in place of a polynomial one, an input lies beyond the range of the fit, or rows
            that the logger wrote a second time are left out.
        """
        import numpy as np

        from estimation.identification.free_run.data import Channels
        from estimation.identification.free_run.from_records import channels_to_run

        runs: list[np.ndarray[Any, Any]] = []
        records = self._records_of(log)
        for one in self.models:
            record = records[one.sample_time]
            if record is None:
                run = one.free_run(log)
                u = np.asarray(log, dtype=np.float64).reshape(len(run.output), -1)
                part = Channels(one.inputs, one.output, one.sample_time, (u,), (np.full(len(u), np.nan),))
            else:
                part = channels_to_run(record, one.inputs, one.output, one.sample_time)
                run = one.free_run(part.u[0], part.y[0])
            runs.append(run.output)
            _warn_of_inputs(one, part, [run])
        return runs[0] if len(runs) == 1 else np.column_stack(runs)

    def validate(self, log: Any) -> "pd.DataFrame":
        """Return the fit of each output on another log.

        Parameters
        ----------
        log : Log, Record or table
            With the model's channels.

        Returns
        -------
        pandas.DataFrame
            By output: ``fit_percent`` and ``rmse`` of the free run, ``one_step_percent`` and ``one_step_rmse``.

        Raises
        ------
        HydrostateError
            If a channel is missing.

        Warns
        -----
        LogWarning
            As in `simulate`, or if the error is clearly larger than on held-back blocks of the fitted logs.
        """
        import pandas as pd

        from estimation.identification.free_run.validation_notes import validation_notes

        rows: dict[str, Any] = {}
        records = self._records_of(log)
        for one, expected in zip(self.models, self._expected, strict=True):
            if (record := records[one.sample_time]) is None:
                refuse(f"a Log, a Record or a table with the channels is needed, got {type(log).__name__}")
            part = _channels(one, record, split=True)
            quality, ran = one.quality_and_runs(part.u, part.y)
            _warn_of_inputs(one, part, ran)
            for note in validation_notes(one, quality, expected, "the log"):
                warnings.warn(LogWarning(note), stacklevel=2)
            rows[one.output] = vars(quality)
        return pd.DataFrame.from_dict(rows, orient="index")

    def _records_of(self, log: Any) -> "dict[float, Record | None]":
        """Return the record of a log for each sample time of the models, without rows that were sent twice."""
        names = [*dict.fromkeys(name for one in self.models for name in (*one.inputs, one.output))]
        return {
            sample_time: _record_of(log, sample_time, names) for sample_time in {o.sample_time for o in self.models}
        }

    def to_control(self) -> "TransferFunction | StateSpace":
        """Return linear models as one python-control object, one row per output.

        Returns
        -------
        control.TransferFunction or control.StateSpace
            A `control.StateSpace` for state space models, in the channels' units. Offsets are left out.
        """
        import control

        from estimation.identification.state_space.dynamics import StateSpaceDynamics

        outputs = [one.dynamics for one in self.models if isinstance(one.dynamics, StateSpaceDynamics)]
        if outputs and len(outputs) == len(self.models) == len(outputs[0].system.c):
            return _shared_states(self.models, outputs)
        if len(self.models) == 1:
            return self.models[0].to_control()
        parts = [one.to_control() for one in self.models]
        numerators, denominators = ([part.num_list[0] for part in parts], [part.den_list[0] for part in parts])
        return control.TransferFunction(numerators, denominators, self.models[0].sample_time)

    def to_dict(self) -> list[dict[str, Any]]:
        """Return the models as JSON values, one for each output."""
        return [one.to_dict() for one in self.models]

    def save(self, path: str | Path) -> None:
        """Write the models to a JSON file that `hydrostate.load_model` and ``identify --simulate`` read."""
        from estimation.identification.free_run.saved import save_models

        save_models(self.models, path)

    def to_frame(self) -> "pd.DataFrame":
        """Return the quality of the models as a table.

        Returns
        -------
        pandas.DataFrame
            By output: structure, fitted values, and the fits of the free run.
        """
        import pandas as pd

        kept = ("structure", "n_values", "fit_percent", "held_back_percent", "one_step_percent", "rmse")
        if self._entries:
            rows = {one["output"]: {name: one[name] for name in kept} for one in self._entries}
        else:
            rows = {one.output: {"structure": one.structure, "n_values": one.n_values} for one in self.models}
        return pd.DataFrame.from_dict(rows, orient="index")

    def report(self, path: str | Path, title: str = "log") -> list[Path]:
        """Write the page of each model, as ``hydrostate identify --report`` does.

        Parameters
        ----------
        path : str or Path
            Path of the file. ``.html`` is added to a name without an ending; with several outputs, each file name also
            contains its output's name.
        title : str
            Name of the log on the pages.

        Returns
        -------
        list of Path
            The files written, one for each output.

        Raises
        ------
        HydrostateError
            If a file cannot be written, its name does not end like a page, or the models were loaded without a log.
        """
        from experiments.command.output_paths import paths_by_owner
        from experiments.python_user.own_page import page_of_columns, page_path, write_page

        if not self._data:
            refuse("models that were loaded have no log to show them on; a page is written where they are identified")
        places = paths_by_owner(page_path(path), [one.output for one in self.models])
        shown = zip(self.models, self._entries, self._data, strict=True)
        return [
            write_page(places[one.output], page_of_columns(entries, one, data, title)) for one, entries, data in shown
        ]

    def plot(self) -> "list[Axes]":
        """Draw measured and simulated output, and the difference, in one figure per output.

        Returns
        -------
        list of matplotlib.axes.Axes
            Two for each output.
        """
        from experiments.log_pages.free_run_figure import draw_free_run

        pairs = zip(self.models, self._data, strict=False)
        return [axis for model, data in pairs for axis in draw_free_run(model, data, "log").axes]


def _shared_states(models: "Sequence[FreeRunModel]", outputs: "Sequence[StateSpaceDynamics]") -> "StateSpace":
    """Return the state space shared by all outputs; dead times become states."""
    import control

    from estimation.identification.state_space.dynamics import system_in_units

    one = system_in_units(outputs, [model.scaling for model in models])
    names = {"inputs": list(models[0].inputs), "outputs": [model.output for model in models]}
    return control.StateSpace(*one.with_delays_as_states(), one.sample_time, **names)


def _record_of(log: Any, sample_time: float, names: Sequence[str]) -> "Record | None":
    """Return the record of a log or table; None for plain arrays. Rows without a time are `sample_time` apart.

    Rows that were sent twice are left out; they are detected by the named columns that the log contains.
    """
    from estimation.identification.free_run.from_records import without_repeated_rows
    from experiments.python_user.log import Log
    from plant.log.any_columns import read_any
    from plant.log.frames import by_name, frame_table, is_frame
    from plant.log.record import Record

    if isinstance(log, str | Path):
        refuse(f"a log is needed, got the text {str(log)!r}; hydrostate.read opens a file")
    record: Record | None
    if isinstance(log, Log | Record):
        record = log.related if isinstance(log, Log) else log
    else:
        table = log if is_frame(log) else by_name(log)
        record = None if table is None else read_any(frame_table(table), assumed=sample_time)
    return None if record is None else without_repeated_rows(record, [name for name in names if name in record])


def _warn_of_inputs(model: "FreeRunModel", data: "Channels", runs: "Sequence[FreeRun]") -> None:
    from estimation.identification.free_run.input_range import doubts_about_inputs

    for note in doubts_about_inputs(model, data, runs):
        warnings.warn(LogWarning(note), stacklevel=3)


def _channels(model: "FreeRunModel", record: "Record", *, split: bool = False) -> "Channels":
    from estimation.identification.free_run.from_records import channels_of

    return channels_of([record], model.inputs, model.output, model.sample_time, split=split)


def identified(records: "Sequence[Record]", inputs: Any, outputs: Any, options: Mapping[str, Any]) -> Relation:
    """Return the relation between channels of logs.

    Parameters
    ----------
    records : sequence of Record
        One log or several.
    inputs, outputs : str or sequence of str
        Channels.
    options : Mapping[str, Any]
        Options of `identify_outputs`, the model's ``sample_time`` [s], and ``reference``, the channels that drive a
        closed loop.
    """
    from estimation.identification.free_run.from_records import without_repeated_rows
    from estimation.identification.two_stage import identify_columns
    from experiments.identification.entries import column_entries

    asked = dict(options)
    given = {"input": inputs, "output": outputs, "reference": asked.pop("reference", None) or ()}
    columns = [names_of(name, one) for name, one in given.items()]
    sources, targets, references = columns
    sample_time = asked.pop("sample_time", None)
    once = [without_repeated_rows(one, [*sources, *targets, *references]) for one in records]
    found, data = identify_columns(
        once, sources, targets, references=references, sample_time=sample_time, options=asked
    )
    expected = [one.expected_error for one in found]
    return Relation([one.model for one in found], [column_entries(one) for one in found], data, expected)
