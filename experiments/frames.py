"""Reading single numbers out of tables."""

from typing import SupportsFloat, cast

import pandas as pd


def cell(frame: pd.DataFrame, row: object, column: str) -> float:
    """Return one number of a table.

    Parameters
    ----------
    frame : pandas.DataFrame
        A table with unique row labels.
    row : object
        Row label.
    column : str
        Column name, which carries the unit.

    Returns
    -------
    float
        The number, in the column's unit.

    Examples
    --------
    >>> cell(pd.DataFrame({"speed_rpm": [1200]}, index=["rated"]), "rated", "speed_rpm")
    1200.0
    """
    return float(cast("SupportsFloat", frame.at[row, column]))
