"""Numbers that the piezo-stack paper's text quotes from its figures, beside ours (the figures are lost, errata P17)."""

from collections.abc import Mapping

import pandas as pd

from experiments.page.frames import Rows, as_table
from experiments.papers.printed import claim_row, read_csv
from experiments.papers.stack_claims import figure_results
from experiments.papers.verdict import Basis, verdict_of

ROLES: Mapping[Basis, str] = {
    "target": "calibration target",
    "model": "prediction",
    "computed": "computed",
}
"""How the model used a quoted number."""


@as_table
def quoted_numbers(tables: Mapping[str, pd.DataFrame]) -> Rows:
    """Return the numbers that the paper's text quotes from its curves, beside those of the figures' tables.

    Claims, tolerances and the verdict rule are those of `hydrostate papers`.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The tables of `experiments.piezo_stack.flow.figure_points`, and that of `loop_widths` as ``figure 10 loop
        widths``.

    Returns
    -------
    pandas.DataFrame
        Columns where, claim, published, ours, unit, role (calibration target or prediction), verdict, note.
    """
    ours = figure_results({name.replace(" ", "_"): table for name, table in tables.items()})
    for line in read_csv("claims.csv"):
        if line["paper"] == "000" and line["key"] in ours:
            row = claim_row(line, ours[line["key"]])
            yield {
                "where": row.where,
                "claim": row.claim,
                "published": row.printed,
                "ours": row.ours.value,
                "unit": row.unit,
                "role": ROLES[row.basis],
                "verdict": verdict_of(row).value,
                "note": row.note,
            }
