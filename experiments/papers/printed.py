"""Claims in the text of the three papers, and their figures: ``claims.csv`` and ``figures.csv``."""

from collections.abc import Mapping
from importlib.resources import files

import pandas as pd

from experiments.papers.verdict import Basis, OurResult, Row

_BASES: Mapping[str, Basis] = {"computed": "computed", "model": "model", "target": "target"}


def read_csv(name: str) -> list[dict[str, str]]:
    """Return the lines of one of this folder's tables, as text.

    Parameters
    ----------
    name : str
        ``claims.csv`` or ``figures.csv``.
    """
    with files("experiments.papers").joinpath(name).open(encoding="utf-8") as stream:
        frame = pd.read_csv(stream, dtype=str, keep_default_na=False)
    return [{str(key): str(value) for key, value in row.items()} for row in frame.to_dict("records")]


def claim_row(row: Mapping[str, str], ours: OurResult) -> Row:
    """Return a claim with our result."""
    text = row["value"]
    value = None if not text else text if row["accept"] == "same" else float(text)
    return Row(
        paper=row["paper"],
        where=row["where"],
        claim=row["claim"],
        printed=row["printed"],
        value=value,
        unit=row["unit"],
        accept=row["accept"],
        basis=_BASES[row["basis"]],
        ours=ours,
        errata=row["errata"],
        shown_by=f"hydrostate {row['verb']}",
        note=row["note"],
    )
