"""The page of the three papers: every table, figure and claim, with our result and the verdict of one rule."""

import re
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd

from experiments.diaphragm_motor.sweeps import bent_plate, mode_shapes
from experiments.page.errata import link_numbers
from experiments.page.frames import Rows, Tables, as_table
from experiments.page.numbers import MINUS, MISSING, SUPERSCRIPTS, TIMES, exact, number
from experiments.page.tables import Cell, Column, Columns, Row, right_aligned
from experiments.papers.claims import PAPERS, all_rows, figure_table, row_table
from experiments.papers.figures import PAPERS_FIGURES
from experiments.papers.parts import PapersSettings, gather_tables, quick_papers
from experiments.papers.verdict import MISSED_VERDICTS, TONES, Drawn, Verdict
from experiments.running.progress import Track, run_as_one_piece
from experiments.running.study import Study, StudyResult
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.eha.circuit_parameters import CircuitParameters
from plant.piezo_stack.parameters import PiezoStackParameters

SECTIONS: Mapping[str, str] = {"002": "rows of 002", "000": "rows of 000", "001": "rows of 001"}
"""Name of the page's table for each paper."""


def papers_study(parts: Path) -> Study[PapersSettings]:
    """Return the study of the three papers, whose parts are kept in a folder.

    Parameters
    ----------
    parts : Path
        The folder of the parts; existing unchanged parts are reused.
    """

    def find(settings: PapersSettings, track: Track) -> StudyResult:
        found = gather_tables(parts, settings, track)
        rows = run_as_one_piece(track, "verdicts", lambda: row_table(all_rows(found)))
        tables = {"rows": rows, "figures": figure_table(rows)}
        tables["verdicts"] = verdict_counts(rows)
        shown = {"table 4": found["motor-paper"]["table_4"], "table 5": found["motor-paper"]["table_5"]}
        drawn = {"poles": found["motor-paper"]["poles"], "dry modes": found["diaphragm-motor"]["dry_modes"]}
        ours = {"bent plate": bent_plate(), "mode shapes": mode_shapes()}
        return StudyResult({**tables, **shown, **drawn, **ours})

    return Study("papers", "papers/report.html", find, PAPERS_FIGURES, COLUMNS, PARAMETERS, _facts)


@as_table
def verdict_counts(rows: pd.DataFrame) -> Rows:
    """Return the number of rows per verdict, for each paper."""
    for paper, of_one in rows.groupby("paper", sort=False):
        counts = of_one["verdict"].value_counts()
        yield {
            "paper": paper,
            **{verdict.value: int(counts.get(verdict.value, 0)) for verdict in Verdict},
            "rows": len(of_one),
            "empty": int(of_one["ours"].isna().sum()),
        }


def _facts(tables: Tables, settings: PapersSettings) -> Mapping[str, Any]:
    rows, figures = tables["rows"], tables["figures"]
    return {
        **{name: rows[rows["paper"] == PAPERS[paper]] for paper, name in SECTIONS.items()},
        "papers": {paper: (PAPERS[paper], name) for paper, name in SECTIONS.items()},
        "drawn": {kind.value: int((figures["drawn"] == kind.value).sum()) for kind in Drawn},
        "count": len(rows),
        "agreed": int((~rows["verdict"].isin(MISSED_VERDICTS)).sum()),
        "missed": int((rows["verdict"] == Verdict.NOT_REPRODUCED).sum()),
        "errata_count": int((rows["verdict"] == Verdict.ERRATUM).sum()),
        "empty": int(rows["ours"].isna().sum()),
        "quick": settings == quick_papers(settings.seed),
    }


def _verdict(word: str) -> Cell:
    return Cell(word, TONES[word])


def _with_powers_of_ten(text: str) -> str:
    """Return a number such as -4.1e-6 with typographic signs and powers of ten; other texts are unchanged."""
    found = re.fullmatch(r"(-?[\d.]+)(?:e(-?\d+))?", text)
    if found is None:
        return text
    power = f"{TIMES}10{found[2].translate(SUPERSCRIPTS)}" if found[2] else ""
    return found[1].replace("-", MINUS) + power


def _our_cell(row: Row) -> Cell:
    value = row["ours"]
    if isinstance(value, str):
        return Cell(value)
    if value is None or value != value:
        return right_aligned(MISSING)
    powers = re.fullmatch(r"-?\d\.?(\d*)e(-?\d+)", str(row["printed"]))
    if powers is not None:  # the printed power of ten and one more digit, so that both can be compared
        decimals, exponent = len(powers[1]) + 1, int(powers[2])
        return right_aligned(_with_powers_of_ten(f"{value / float(f'1e{exponent}'):.{decimals}f}e{exponent}"))
    # one digit more than printed, so that both can be compared
    digits = max(5, 1 + len(re.sub(rf"(e|{TIMES.strip()}).*|\D", "", str(row["printed"])).lstrip("0")))
    return right_aligned(exact(float(f"{value:.{min(digits, 10)}g}")))


def _limits(row: Row) -> str:
    low, high = row["low"], row["high"]
    told = _tolerance(row["accept"])
    if low is None or low != low:
        return told
    return f"{told}; ours {number(float(low))} to {number(float(high))}"


def _tolerance(accept: str) -> str:
    """Return the tolerance of a row in words, with ranges in few digits."""
    if accept == "digits":
        return "half a unit of the last digit"
    words = accept.split()
    if len(words) == 3 and words[1] == "to":
        return f"{number(float(words[0]))} to {number(float(words[2]))}"
    return accept


_ROWS: Columns = (
    *("where", "claim"),
    Column("printed", words=lambda printed: right_aligned(_with_powers_of_ten(printed))),
    Column("ours", of_row=_our_cell),
    "unit",
    Column("accept", "tolerance or interval", of_row=_limits),
    Column("verdict", words=_verdict),
    Column("errata", words=link_numbers),
    Column("shown_by", "command"),
    "note",
)

COLUMNS: Mapping[str, Columns] = {
    **dict.fromkeys(SECTIONS.values(), _ROWS),
    "verdicts": (
        "paper",
        *(verdict.value for verdict in Verdict),
        "rows",
        Column("empty", "rows without a value of ours"),
    ),
    "figures": (
        *("paper", "figure", "title"),
        Column("drawn", words=_verdict),
        Column("missed", "rows that do not agree"),
        Column("rows", "rows about it"),
        Column("difference", "difference or reason"),
        Column("shown_by", "command: drawing"),
    ),
}

PARAMETERS = {
    "circuit": asdict(CircuitParameters()),
    "piezo-stack": asdict(PiezoStackParameters()),
    "diaphragm-motor": asdict(DiaphragmMotorParameters()),
}
