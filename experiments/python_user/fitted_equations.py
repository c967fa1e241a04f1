"""Result of fitting a user's own equations in Python, and the logs accepted by such a fit."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from experiments.python_user.answers import Shown
from plant.errors import HydrostateError

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from matplotlib.axes import Axes

    from estimation.equations.fit import EquationsFit
    from estimation.finding import Quantity
    from plant.log.record import Record

_FIVE = "{:.5g}".format


class FittedGreyBox(Shown):
    """Result of fitting a user's own equations."""

    def __init__(self, fit: "EquationsFit", records: "Sequence[Record]") -> None:
        self.fit, self._records = fit, tuple(records)

    def __getattr__(self, name: str) -> Any:
        if not name.startswith("_") and name in type(self.fit.finding).__dataclass_fields__:
            return getattr(self.fit.finding, name)
        return super().__getattr__(name)

    @property
    def values(self) -> Mapping[str, float]:
        """Every parameter [its unit]."""
        return self.fit.values

    @property
    def quantities(self) -> "Mapping[str, Quantity]":
        """Parameters and fitted initial states with 95 % intervals; value None if the logs do not determine it."""
        return self.fit.finding.quantities

    @property
    def believed(self) -> bool:
        """Whether the values pass every check."""
        return self.fit.finding.gate.passed

    @property
    def condition(self) -> float:
        """Condition number of the scaled sensitivities; a large value means that parameters are hard to separate."""
        return self.fit.covariance.condition

    @property
    def fit_percent(self) -> Mapping[str, float]:
        """Fit of each output: 100 is perfect, 0 is no better than the output's mean."""
        return self.fit.fit_percent

    @property
    def noise(self) -> Mapping[str, float]:
        """Standard deviation of the noise of each output."""
        return self.fit.noise

    @property
    def correlation(self) -> "pd.DataFrame":
        """Correlation between the errors of the parameters."""
        import pandas as pd

        names = list(self.fit.solution.problem.names)
        return pd.DataFrame(self.fit.covariance.correlation, index=names, columns=names)

    def __str__(self) -> str:
        said = ", ".join(f"{name} {fit:.1f} %" for name, fit in self.fit_percent.items())
        verdict = "believed" if self.believed else "not to be believed"
        notes = "".join(f"\n- {note}" for note in self.fit.finding.all_notes)
        return f"Fit: {said}; {verdict}\n{self.to_frame().to_string(float_format=_FIVE)}{notes}"

    def _repr_html_(self) -> str:
        from html import escape

        notes = "".join(f"<li>{escape(str(note))}</li>" for note in self.fit.finding.all_notes)
        return f"{self.to_frame().to_html(float_format=_FIVE)}<ul>{notes}</ul>"

    def to_frame(self) -> "pd.DataFrame":
        """Return values and intervals as a table.

        Returns
        -------
        pandas.DataFrame
            By name: value, standard deviation, ends of the 95 % interval, unit.
        """
        import pandas as pd

        rows = {
            name: (one.value, one.std, *(one.ci95 or (None, None)), one.unit) for name, one in self.quantities.items()
        }
        return pd.DataFrame.from_dict(rows, orient="index", columns=["value", "std", "ci95_low", "ci95_high", "unit"])

    def to_dict(self) -> dict[str, Any]:
        """Return everything as JSON values.

        Returns
        -------
        dict[str, Any]
            Outcome, values, gate and notes.
        """
        from experiments.command.json_output import plain

        found = self.fit.finding
        return plain(
            {
                "outcome": found.outcome,
                "believed": self.believed,
                "parameters": {name: vars(one) for name, one in self.quantities.items()},
                "fit_percent": dict(self.fit_percent),
                "noise": dict(self.noise),
                "condition_number": self.condition,
                "notes": [note.to_dict() for note in found.all_notes],
            }
        )

    def simulate(self, log: Any, initial: Mapping[str, float] | None = None) -> "pd.DataFrame":
        """Return the outputs of the fitted equations on a log.

        Parameters
        ----------
        log : Log, Record or pandas.DataFrame
            Must contain the inputs. If it also contains the outputs, free initial states are fitted to them.
        initial : Mapping[str, float], optional
            The states at the first sample [their units].

        Returns
        -------
        pandas.DataFrame
            One column for each output, by time [s].
        """
        import pandas as pd

        record = record_of(log)
        return pd.DataFrame(dict(self.fit.predicted(record, initial)), index=times_of(log, record))

    def plot(self) -> "list[Axes]":
        """Draw measured and fitted outputs of every log, with the residuals below.

        Returns
        -------
        list of matplotlib.axes.Axes
            Two for each output and log.
        """
        import matplotlib.pyplot as plt

        pairs = [
            (record, name, residual)
            for record, rows in zip(self._records, self.fit.residuals, strict=True)
            for name, residual in rows.items()
        ]
        size = (8.0, 2.2 * len(pairs) + 1.0)
        _, axes = plt.subplots(2 * len(pairs), 1, squeeze=False, figsize=size, layout="constrained")
        for (record, name, residual), above, below in zip(pairs, axes[::2, 0], axes[1::2, 0], strict=True):
            above.plot(record.time, record[name], lw=0.8, label="measured")
            above.plot(record.time, record[name] + residual, lw=0.8, label="fitted")
            above.set_ylabel(_label(name, self.fit.equations.outputs[name]))
            above.legend(fontsize=8)
            below.plot(record.time, residual, lw=0.6, color="C2")
            below.set(ylabel="difference", xlabel="time [s]")
        return list(axes[:, 0])


def _label(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} [{unit}]"


def record_of(log: Any) -> "Record":
    """Return the record of a log, of a record itself, or of a table.

    The time of a table is its index: seconds, dates, durations, or as its name says, such as ``time_ms``. If the index
    only counts rows, it is the column that is named so.

    Parameters
    ----------
    log : Log, Record or pandas.DataFrame
        The user's log.

    Raises
    ------
    HydrostateError
        If it is none of them, or a table has no uniform clock.

    Warns
    -----
    LogWarning
        If a table's rows are only counted: then they are 1 s apart.
    """
    import pandas as pd

    from experiments.python_user.log import Log
    from plant.log.record import Record

    if isinstance(log, pd.DataFrame):
        return _of_table(log)
    record = log.whole() if isinstance(log, Log) else log
    if not isinstance(record, Record):
        raise HydrostateError(f"a Log, a Record or a pandas.DataFrame is needed, got {type(log).__name__}")
    return record


def times_of(log: Any, record: "Record") -> "pd.Index[Any]":
    """Return the times of the simulated samples: a table keeps its own index, so that columns can be added to it."""
    import pandas as pd

    return log.index if isinstance(log, pd.DataFrame) else pd.Index(record.time, name="time_s")


def _of_table(table: "pd.DataFrame") -> "Record":
    import numpy as np

    from plant.log.record import Record

    time = _time_of(table)
    dates = [name for name in table.columns if table[name].dtype.kind in "mM"]
    try:
        columns = {str(name): table[name].to_numpy(dtype=np.float64) for name in table.columns if name not in dates}
    except (TypeError, ValueError) as error:
        raise HydrostateError(f"a table of numbers by time [s] is needed: {error}") from None
    steps = np.diff(time)
    if len(steps) == 0 or not steps[0] > 0.0 or np.abs(steps - steps[0]).max() > 1e-3 * steps[0]:
        raise HydrostateError("the index of a table must be the time [s] on a uniform clock")
    return Record(float(np.mean(steps)), columns, start_time=float(time[0]))


def _time_of(table: "pd.DataFrame") -> "np.ndarray[Any, Any]":
    """Return the times of a table's rows [s]."""
    import warnings

    import numpy as np

    from plant.errors import LogWarning
    from plant.log.any_columns import is_time_name, time_of
    from plant.log.frames import SOURCE, frame_table
    from plant.log.notes import LogCode

    index = table.index
    if index.dtype.kind in "iu" and not is_time_name(index.name):
        named = [name for name in table.columns if is_time_name(name)]
        if not named:
            counted: np.ndarray[Any, Any] = index.to_numpy(dtype=np.float64)
            if np.all(np.diff(counted) == 1.0):
                note = LogCode.CLOCK_ASSUMED.note(sample_time_s=1.0)
                warnings.warn(LogWarning(note, SOURCE), stacklevel=5)
            return counted
        time = time_of(frame_table(table[named[:1]].reset_index(drop=True)))
    else:
        time = time_of(frame_table(table[[]].assign(row=0.0)))
    if time is None:
        raise HydrostateError("a table of numbers by time is needed: its index holds neither times nor row numbers")
    return time
