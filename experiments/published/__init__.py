"""The published results, as printed: tables and scalars of the EHA paper, and tables of the diaphragm-motor paper.

Nothing here is corrected. ``docs/errata.md`` lists by number where the project departs from the papers.
"""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

from plant.errors import require_known

if TYPE_CHECKING:
    import pandas as pd

TableName: TypeAlias = Literal["conditions", "parameters", "leakage", "friction", "rmse", "transfer_functions"]

MotorTableName: TypeAlias = Literal["table1_geometry", "table2", "fig12_anova", "table4_flow", "table5_actuators"]
"""The diaphragm-motor paper's tables, and the regression in its Figure 12."""


@dataclass(frozen=True)
class PublishedScalar:
    """A number that is in the paper's text but in none of its tables.

    Parameters
    ----------
    value : float
        As printed, in units of `unit`.
    si_value : float
        The same in SI, in units of `si_unit`.
    si_unit : str
        The SI unit; ``"1"`` for a ratio.
    where : str
        Section of the paper, with the erratum if one applies.
    """

    value: float
    unit: str
    si_value: float
    si_unit: str
    meaning: str
    where: str


def _scalars() -> Mapping[str, PublishedScalar]:
    with files(__name__).joinpath("eha_scalars.csv").open(encoding="utf-8") as stream:
        return {
            row.pop("name"): PublishedScalar(value=float(row.pop("value")), si_value=float(row.pop("si_value")), **row)
            for row in csv.DictReader(stream)
        }


SCALARS: Mapping[str, PublishedScalar] = MappingProxyType(_scalars())

_FILES: Mapping[TableName | MotorTableName, str] = {
    **{name: f"eha_table{number}_{name}.csv" for number, name in enumerate(get_args(TableName), start=1)},
    **{name: f"motor_{name}.csv" for name in get_args(MotorTableName)},
}


def load(name: TableName | MotorTableName) -> "pd.DataFrame":
    """Return a published table, one row for each row of the paper's table, with units in the column names.

    Parameters
    ----------
    name : TableName or MotorTableName
        One of the EHA paper's Tables 1 to 6, in this order, or of the diaphragm-motor paper's. The transfer functions
        are ``(b0 z^2 + b1 z + b2) / (z^2 + a1 z + a2)``; their sample time and input are not given (errata E14).

    Returns
    -------
    pandas.DataFrame
        The table as printed; a fresh copy at each call.

    Raises
    ------
    HydrostateError
        If there is no such table.

    Examples
    --------
    >>> table = load("leakage").set_index("leakage")
    >>> table.loc["major", "leakage_coefficient_m3_per_s_pa"]
    np.float64(6.006e-11)
    """
    import pandas as pd

    require_known("published table", name, _FILES)
    with files(__name__).joinpath(_FILES[name]).open(encoding="utf-8") as stream:
        return pd.read_csv(stream, keep_default_na=False)


def as_printed(name: TableName | MotorTableName) -> "pd.DataFrame":
    """Return a published table as `load` does, with every cell as the printed text.

    Returns
    -------
    pandas.DataFrame
        Text, digit for digit; a fresh copy at each call.

    Raises
    ------
    HydrostateError
        If there is no such table.

    Examples
    --------
    >>> as_printed("friction")["a2_n_s_per_m"].tolist()
    ['2.144e3', '-7.440e3', '1.863e4']
    """
    import pandas as pd

    require_known("published table", name, _FILES)
    with files(__name__).joinpath(_FILES[name]).open(encoding="utf-8") as stream:
        return pd.read_csv(stream, keep_default_na=False, dtype=str)
