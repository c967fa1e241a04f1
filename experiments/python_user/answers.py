"""Answers about a log in Python: they print and draw themselves, and convert to tables."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from pathlib import Path

    import pandas as pd
    from control import TransferFunction
    from matplotlib.axes import Axes

    from estimation.finding import Finding, Quantity
    from estimation.identification.model.linear_model import LinearModel
    from plant.notes import Note


_FIVE = "{:.5g}".format


def no_such(owner: str, name: str, known: Sequence[str]) -> str:
    """Return the error sentence for an unknown name.

    Returns
    -------
    str
        With the closest name, or with all names.

    Examples
    --------
    >>> no_such("Log", "estimat", ["estimate", "diagnose"])
    "Log has no 'estimat'; did you mean 'estimate'?"
    """
    near = get_close_matches(name, known, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"it has {', '.join(sorted(known))}"
    return f"{owner} has no {name!r}; {hint}"


def refuse(message: str) -> NoReturn:
    """Raise a `HydrostateError`.

    Raises
    ------
    HydrostateError
        Always.
    """
    from plant.errors import HydrostateError

    raise HydrostateError(message)


def names_of(option: str, given: Any) -> list[str]:
    """Return the names of channels, given as one name or several.

    Raises
    ------
    HydrostateError
        If they are not names.

    Examples
    --------
    >>> names_of("input", "valve"), names_of("input", ["valve", "load"])
    (['valve'], ['valve', 'load'])
    """
    names: list[Any] = [given] if isinstance(given, str) or not isinstance(given, Iterable) else list(given)
    if not all(isinstance(one, str) for one in names):
        refuse(f"{option} must be the name of a channel or a list of names, got {given!r:.80}")
    return names


class Shown:
    """An object that prints itself, and names the nearest attribute if one is misspelt."""

    def __repr__(self) -> str:
        return str(self)

    def __getattr__(self, name: str) -> Any:
        from plant.errors import NoSuchNameError

        if name.startswith("_"):
            raise AttributeError(name)
        names = [one for one in dir(self) if not one.startswith("_")]
        raise NoSuchNameError(no_such(type(self).__name__, name, names))


class Named(dict[str, Any]):
    """Entries by name; a misspelt name raises an error with the nearest one."""

    def __missing__(self, name: str) -> NoReturn:
        from plant.errors import NoSuchEntryError

        raise NoSuchEntryError(no_such("the answer", str(name), list(self)))


class Answer(Shown):
    """Answer about a log, to print, draw and pass on.

    Parameters
    ----------
    entries : Mapping[str, Any]
        The answer by the names of the JSON contract.
    screen : callable
        From a list of entries to the terminal output.
    page : callable
        From a title to the page of the log, as HTML.
    name : str
        Name of the log when the answer is printed.
    """

    def __init__(
        self,
        finding: "Finding",
        entries: Mapping[str, Any],
        screen: Any,
        page: Callable[[str], str],
        name: str = "log",
    ) -> None:
        self.finding, self._entries, self._screen, self._page, self._name = finding, entries, screen, page, name

    def __getattr__(self, name: str) -> Any:
        if not name.startswith("_") and name in type(self.finding).__dataclass_fields__:
            found = getattr(self.finding, name)
            return Named(found) if isinstance(found, Mapping) else found
        return super().__getattr__(name)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *type(self.finding).__dataclass_fields__})

    @property
    def bulk_modulus(self) -> "Quantity":
        """Effective bulk modulus [Pa] with its 95 % interval."""
        return self.finding.quantities["bulk_modulus"]

    @property
    def condition(self) -> str | None:
        """Condition found in the log: ``"unknown"`` if all are contradicted, None if no diagnosis was requested."""
        return "unknown" if self.finding.unknown else self.finding.condition

    @property
    def believed(self) -> bool:
        """Whether the numbers passed the checks."""
        return self.finding.gate.passed

    @property
    def all_notes(self) -> "tuple[Note, ...]":
        """Every remark once, as a code with data and a sentence."""
        return self.finding.all_notes

    def __str__(self) -> str:
        from experiments.command.terminal import render_text

        about = {"file": self._name, "warnings": [], "expected": None, "rig": "", "condition": None}
        return render_text(*self._screen([{**about, **self.to_dict()}]))

    def _repr_html_(self) -> str:
        from html import escape

        notes = "".join(f"<li>{escape(str(note))}</li>" for note in self.finding.all_notes)
        table = self.to_frame().to_html(float_format=_FIVE)
        return f"<p>{escape(str(self._entries['message']))}</p>{table}<ul>{notes}</ul>"

    def compare(self, other: "Answer") -> "pd.DataFrame":
        """Return the differences to another answer, one row per quantity.

        Returns
        -------
        pandas.DataFrame
            As in `experiments.log_pages.comparison.differences`; ``second`` is the other answer [the row's unit].
        """
        from experiments.log_pages.comparison import differences

        if not isinstance(other, Answer):  # pyright: ignore[reportUnnecessaryIsInstance] -- a user's slip
            refuse(f"compare needs another answer, such as log.diagnose(), got {type(other).__name__}")
        return differences(self.to_dict(), other.to_dict())

    def to_dict(self) -> dict[str, Any]:
        """Return the entries of the JSON contract.

        Returns
        -------
        dict[str, Any]
            Numbers, text and lists, as ``--json`` prints them.
        """
        from experiments.command.json_output import plain

        return plain(self._entries)

    def to_frame(self) -> "pd.DataFrame":
        """Return quantities and severities as a table.

        Returns
        -------
        pandas.DataFrame
            By name: value, ends of the 95 % interval given the rig and in total, unit.
        """
        import pandas as pd

        every = {**self.finding.quantities, **self.finding.severities}
        absent = (None, None)
        told = [(one.value, *(one.ci95 or absent), *(one.ci95_total or absent), one.unit) for one in every.values()]
        rows = dict(zip(every, told, strict=True))
        ends = [f"{interval}_{end}" for interval in ("ci95", "ci95_total") for end in ("low", "high")]
        return pd.DataFrame.from_dict(rows, orient="index", columns=["value", *ends, "unit"])

    def report(self, path: "str | Path", title: str = "log") -> "Path":
        """Write the page of the log as one HTML file with charts, which works offline.

        Parameters
        ----------
        path : str or Path
            Path of the file. ``.html`` is added to a name without an ending, and missing folders are created.
        title : str
            Name of the log on the page.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        HydrostateError
            If the file cannot be written, or its name does not have the ending of a page.
        """
        from experiments.python_user.own_page import write_page

        return write_page(path, self._page(title))

    def plot(self) -> "list[Axes]":
        """Draw the probabilities, if there are any, and every quantity with its interval.

        Returns
        -------
        list of matplotlib.axes.Axes
            One for the probabilities, then one for each quantity.
        """
        import matplotlib.pyplot as plt

        shares, table = self.finding.probabilities, self.to_frame().dropna()
        rows = [*(["probability"] if shares else []), *table.index]
        size = (8.0, 0.8 * len(rows) + 2.0)
        _, axes = plt.subplots(max(len(rows), 1), 1, squeeze=False, figsize=size, layout="constrained")
        for axis, name in zip(axes[:, 0], rows, strict=False):
            if name == "probability":
                axis.barh([one.replace("_", " ") for one in shares], [100.0 * share for share in shares.values()])
                axis.set_xlabel("probability [%]")
                continue
            one = table.loc[name]
            reach = [[one["value"] - one["ci95_low"]], [one["ci95_high"] - one["value"]]]
            axis.errorbar([one["value"]], [0], xerr=reach, fmt="o", capsize=4)
            axis.set(yticks=[], xlabel=f"{name.replace('_', ' ')} [{one['unit']}]")
        axes[0, 0].set_title(f"{self._entries['message']}"[:100])
        return list(axes[:, 0])


class Model(Shown):
    """An identified transfer function, with all attributes of `LinearModel`.

    Parameters
    ----------
    page : callable
        From a title to the page of the model, as HTML.
    """

    def __init__(self, model: "LinearModel", page: Callable[[str], str]) -> None:
        self.model, self._page = model, page

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "model" or not hasattr(self.model, name):
            return super().__getattr__(name)
        return getattr(self.model, name)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *(one for one in dir(self.model) if not one.startswith("_"))})

    @cached_property
    def _title(self) -> str:
        one = self.model
        order = one.denominator.size - 1
        said = f"{one.structure} model of order {order} from {one.input_name} to {one.output_name}"
        return f"{said}, fit {one.fit_percent:.1f} %"

    def __str__(self) -> str:
        return f"{self._title}\n{self.to_frame().to_string(float_format=_FIVE)}"

    def _repr_html_(self) -> str:
        return f"<p>{self._title}</p>{self.to_frame().to_html(float_format=_FIVE)}"

    def report(self, path: "str | Path", title: str = "log") -> "Path":
        """Write the page of the model to ``path``, as in `Answer.report`, and return the file."""
        from experiments.python_user.own_page import write_page

        return write_page(path, self._page(title))

    def to_control(self) -> "TransferFunction":
        """Return the transfer function for python-control.

        Returns
        -------
        control.TransferFunction
            Discrete, with the model's sample time.
        """
        return self.model.to_control()

    def to_dict(self) -> dict[str, Any]:
        """Return the model in the form that `LinearModel.from_dict` reads.

        Returns
        -------
        dict[str, Any]
            Plain numbers, text and lists.
        """
        return self.model.to_dict()

    def to_frame(self) -> "pd.DataFrame":
        """Return the model's properties as a table.

        Returns
        -------
        pandas.DataFrame
            Steady gain and bandwidth, with their standard deviations.
        """
        import pandas as pd

        one = self.model
        rows = {"dc_gain": (one.dc_gain, one.dc_gain_std), "bandwidth_hz": (one.bandwidth_hz, one.bandwidth_std_hz)}
        return pd.DataFrame.from_dict(rows, orient="index", columns=["value", "std"])

    def plot(self) -> "list[Axes]":
        """Draw gain and phase.

        Returns
        -------
        list of matplotlib.axes.Axes
            Gain [dB] and phase [degrees] over frequency [Hz].
        """
        import matplotlib.pyplot as plt
        import numpy as np

        frequency = np.geomspace(1e-3, 0.5, 400) / self.model.sample_time
        response = np.asarray(self.to_control()(np.exp(2j * np.pi * frequency * self.model.sample_time)))
        _, axes = plt.subplots(2, 1, sharex=True, layout="constrained")
        axes[0].semilogx(frequency, 20.0 * np.log10(np.abs(response)))
        axes[1].semilogx(frequency, np.degrees(np.unwrap(np.angle(response))))
        axes[0].set(title=self._title, ylabel="gain [dB]")
        axes[1].set(ylabel="phase [degrees]", xlabel="frequency [Hz]")
        return list(axes)
