"""Every row of the page: all table cells, all claims of the text from ``claims.csv``, and every figure."""

import re
from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from experiments.circuit.figures import CIRCUIT_FIGURES
from experiments.diaphragm_motor.figures import MOTOR_FIGURES
from experiments.motor_paper.study import MOTOR_PAPER_FIGURES
from experiments.nine_conditions.figures import FIGURES
from experiments.page.figure_files import Drawings
from experiments.page.frames import Rows, as_table
from experiments.page.words import condition_in_words
from experiments.papers.eha_claims import eha_results, printed_by_condition, settled_by_condition
from experiments.papers.eha_tables import eha_table_rows
from experiments.papers.figures import PAPERS_FIGURES
from experiments.papers.motor_claims import motor_results
from experiments.papers.motor_tables import motor_table_rows
from experiments.papers.parts import Evidence
from experiments.papers.printed import claim_row, read_csv
from experiments.papers.stack_claims import stack_results
from experiments.papers.verdict import MISSED_VERDICTS, Row, exclusion_sentence, figure_status, verdict_of
from experiments.piezo_stack.figures import STACK_FIGURES
from plant.errors import HydrostateError

PAPERS: Mapping[str, str] = {
    "002": "gear-pump EHA (002)",
    "000": "piezo-stack EHA (000)",
    "001": "diaphragm motor (001)",
}
"""The papers by number."""

DRAWN_BY: Mapping[str, tuple[Drawings, str]] = {
    "nine": (FIGURES, "hydrostate study"),
    "circuit": (CIRCUIT_FIGURES, "hydrostate circuit"),
    "piezo-stack": (STACK_FIGURES, "hydrostate piezo-stack"),
    "diaphragm-motor": (MOTOR_FIGURES, "hydrostate diaphragm-motor"),
    "motor-paper": (MOTOR_PAPER_FIGURES, "hydrostate motor-paper"),
    "papers": (PAPERS_FIGURES, "hydrostate papers"),
}
"""Figures by study, and the command that draws them."""

FILTER_NOTE = (
    "Equations 7.1 to 7.4, E3 mended, printed Q and R, on the plant that they assume; P_0 is ours (errata E10)."
)


def all_rows(found: Evidence) -> list[Row]:
    """Return every row of the tables and claims of the three papers.

    Raises
    ------
    HydrostateError
        If a claim has nothing beside it, or something stands beside no claim.
    """
    ours = {"002": eha_results(found), "000": stack_results(found["piezo-stack"]), "001": motor_results(found)}
    claims = read_csv("claims.csv")
    for paper, of_paper in ours.items():
        asked = {row["key"] for row in claims if row["paper"] == paper}
        apart = sorted(asked ^ set(of_paper))
        if apart:
            raise HydrostateError(
                f"claims.csv and what stands beside it must have equal keys, got {apart} in one alone"
            )
    rows = [*eha_table_rows(found), *motor_table_rows(found), *_filter_rows(found)]
    rows += [claim_row(row, ours[row["paper"]][row["key"]]) for row in claims]
    order = list(PAPERS)
    return sorted(rows, key=lambda row: order.index(row.paper))


def _filter_rows(found: Evidence) -> Iterator[Row]:
    for condition, ours in settled_by_condition(found["study"]["bulk_modulus"]).items():
        yield Row(
            paper="002",
            where="section 7, Figure 11",
            claim=f"bulk modulus by the published EKF, {condition_in_words(condition)}: where all first guesses settle",
            printed="2.07e8",
            value=2.07e8,
            unit="Pa",
            accept="± 3 %",
            basis="computed",
            ours=ours,
            shown_by="hydrostate study",
            note=FILTER_NOTE,
        )

    for condition, ours in printed_by_condition(found["study"]["printed_equations"]).items():
        yield Row(
            paper="002",
            where="equations 7.1 to 7.7, Figure 11",
            claim=f"bulk modulus by the EKF as printed, {condition_in_words(condition)}: "
            "largest error of all first guesses",
            printed="2.07e8",
            value=None,
            unit="%",
            accept="0 to 3",
            basis="computed",
            ours=ours,
            errata="E3",
            shown_by="hydrostate papers",
            note="Equation 7.3 as printed divides friction by the volume too.",
        )


@as_table
def row_table(rows: list[Row]) -> Rows:
    """Return the rows as a table, each with its verdict by the rule.

    Returns
    -------
    pandas.DataFrame
        Columns paper, where, claim, printed, unit, ours, low, high, accept, basis, errata, verdict, shown_by, note.
    """
    for row in rows:
        yield {
            "paper": PAPERS[row.paper],
            "where": row.where,
            "claim": row.claim,
            "printed": row.printed,
            "unit": row.unit,
            "ours": row.ours.value,
            "low": row.ours.low,
            "high": row.ours.high,
            "accept": row.accept,
            "basis": row.basis,
            "errata": row.errata,
            "verdict": verdict_of(row).value,
            "shown_by": row.shown_by,
            "note": " ".join(
                part for part in (row.ours.said and f"{row.ours.said}.", exclusion_sentence(row), row.note) if part
            ),
        }


@as_table
def figure_table(rows: pd.DataFrame) -> Rows:
    """Return every figure of the three papers: drawn, drawn with a difference, or not drawn, with the reason.

    Parameters
    ----------
    rows : pandas.DataFrame
        Table from `row_table`; rows whose place names a figure refer to that figure.

    Returns
    -------
    pandas.DataFrame
        Columns paper, figure, title, drawn, difference, missed (rows that were not reproduced), rows, shown_by.
    """
    for figure in read_csv("figures.csv"):
        drawings, command = DRAWN_BY[figure["study"]] if figure["study"] else ({}, "")
        drawing = figure["drawing"]
        if drawing and drawing not in drawings:
            raise HydrostateError(f"figures.csv: study {figure['study']} draws no {drawing!r}")
        about = [figure["figure"] in _figures_in(str(where)) for where in rows["where"]]
        own = rows[(rows["paper"] == PAPERS[figure["paper"]]) & np.array(about, dtype=bool)]
        missed = own["verdict"].isin(list(MISSED_VERDICTS))
        yield {
            "paper": PAPERS[figure["paper"]],
            "figure": int(figure["figure"]),
            "title": figure["title"],
            "drawn": figure_status(bool(drawing), figure["difference"], own["verdict"].tolist()).value,
            "difference": figure["difference"],
            "missed": int(missed.sum()),
            "rows": len(own),
            "shown_by": f"{command}: {drawing}" if drawing else "",
        }


def _figures_in(where: str) -> set[str]:
    """Return the figures that a place names; a range includes all its figures.

    Examples
    --------
    >>> sorted(_figures_in("section 5.1.2, Figures 22 to 24"))
    ['22', '23', '24']
    """
    named = {str(number) for number in re.findall(r"Figure (\d+)", where)}
    for low, high in re.findall(r"Figures (\d+) to (\d+)", where):
        named |= {str(number) for number in range(int(low), int(high) + 1)}
    return named
