"""The parts behind the page: kept, read again, remade if anything changed; and the page made from real parts."""

from collections.abc import Callable, Mapping
from pathlib import Path

import pandas as pd
import pytest
from rich.console import Console

from experiments.circuit.study import circuit_studies
from experiments.nine_conditions.printed_equations import printed_equations
from experiments.page.frames import Tables
from experiments.papers import parts
from experiments.papers.claims import figure_table, row_table
from experiments.papers.parts import PapersSettings, gather_tables, quick_papers, read_tables
from experiments.papers.study import papers_study
from experiments.papers.verdict import OurResult, Row
from experiments.piezo_stack.left_out import figure_12_left_out
from experiments.running.progress import Track, without_progress
from experiments.running.study import StudyResult, run_study
from faults.conditions import CONDITIONS

QUICK = quick_papers(7)


class Stop(KeyboardInterrupt):
    pass


def stand_in(monkeypatch: pytest.MonkeyPatch, stop_at: str = "") -> list[str]:
    """Replace the parts by three that record that they are made; one of them may be interrupted."""
    made: list[str] = []

    def maker(name: str) -> Callable[[PapersSettings, Track], Tables]:
        def make(settings: PapersSettings, _: Track) -> Tables:
            if name == stop_at:
                raise Stop
            made.append(name)
            return {"a table, named": pd.DataFrame({"level": ["none"], "value": [0.1 + 0.2], "seed": [settings.seed]})}

        return make

    names: Mapping[str, object] = {name: maker(name) for name in ("one", "two", "three")}
    monkeypatch.setattr(parts, "PARTS", names)
    return made


def test_an_interrupted_run_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = stand_in(monkeypatch, stop_at="three")
    with pytest.raises(Stop):
        gather_tables(tmp_path, QUICK, without_progress)
    assert made == ["one", "two"]
    made = stand_in(monkeypatch)
    found = gather_tables(tmp_path, QUICK, without_progress)
    assert made == ["three"]
    assert list(found) == ["one", "two", "three"]


def test_a_table_is_read_back_unchanged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in(monkeypatch)
    table = gather_tables(tmp_path, QUICK, without_progress)["two"]["a_table_named"]
    assert table.to_dict("records") == [{"level": "none", "value": 0.1 + 0.2, "seed": 7}]


@pytest.mark.parametrize("change", ["settings", "sources", "a file"])
def test_a_part_is_run_again_after_a_change_of_sources_settings_or_files(
    change: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in(monkeypatch)
    gather_tables(tmp_path, QUICK, without_progress)
    made = stand_in(monkeypatch)
    if change == "sources":
        monkeypatch.setattr(parts, "sources_digest", lambda: "another")
    if change == "a file":
        (tmp_path / "two" / "tables" / "a_table_named.csv").unlink()
    gather_tables(tmp_path, quick_papers(8) if change == "settings" else QUICK, without_progress)
    assert made == (["two"] if change == "a file" else ["one", "two", "three"])


def test_a_claim_counts_for_each_figure_that_it_names() -> None:
    def row(where: str, ours: float) -> Row:
        words = {"paper": "002", "where": where, "claim": "a claim", "printed": "1", "unit": "", "accept": "digits"}
        return Row(**words, value=1.0, basis="model", ours=OurResult(ours), shown_by="hydrostate circuit")

    rows = row_table([row("section 4, Figure 5", 3.0), row("section 4, Figure 6", 1.0), row("Figures 9 to 10", 9.0)])
    drawn = figure_table(rows).set_index(["paper", "figure"])["drawn"]["gear-pump EHA (002)"]
    assert drawn.loc[[5, 6, 9, 10]].tolist() == [
        "drawn with a difference",
        "drawn",
        "drawn with a difference",
        "drawn with a difference",
    ]


SMALL = PapersSettings(
    7, (0.0, 5e8), duration=1.0, sample_time=1e-3, identification_duration=2.5, seeds=1, calibrations=1, turns=1
)


def page_of_the_papers(folder: Path) -> None:
    page = run_study(papers_study(folder / "parts"), SMALL, folder / "papers", Console(quiet=True))
    assert page.name == "report.html"
    words = page.read_text(encoding="utf-8")
    tables = read_tables(folder / "papers")
    rows, figures = tables["rows"], tables["figures"]
    assert len(rows) > 500
    assert set(rows["verdict"]) == {"reproduced", "predicted", "calibrated", "not reproduced", "erratum"}
    assert rows[["printed", "accept", "shown_by"]].notna().all().all()
    assert not rows.duplicated(["paper", "where", "claim"]).any(), rows[rows.duplicated(["paper", "where", "claim"])]
    assert figures["drawn"].notna().all()
    assert len(figures) == 11 + 14 + 50
    assert all(f">{verdict}<" in words for verdict in set(rows["verdict"]) | set(figures["drawn"]))
    verdicts = rows.set_index(["where", "claim"])["verdict"]
    assert verdicts["section 7.1, Figure 47", "peak flow"] == "calibrated"
    assert verdicts["Table 2", "(11) velocity, by equation 18 and one piston, row 3"] == "erratum"
    assert (
        verdicts["section 4, Figure 5", "curves share their shape: break frequency at a mean of 7 V"]
        == "not reproduced"
    )
    assert verdicts["Figure 12", "r square"] == "reproduced"
    assert verdicts["section 4", "dead zone under major leakage"] == "predicted"


@pytest.mark.slow
def test_every_claim_on_the_page_of_the_papers_has_a_verdict(tmp_path: Path) -> None:
    page_of_the_papers(tmp_path)


@pytest.mark.slow
def test_every_claim_has_a_verdict_with_tables_of_the_other_studies(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    study: StudyResult,
    stack_tables: Tables,
    motor_tables: Tables,
    motor_paper_tables: Tables,
) -> None:
    chambers = {"value_pa": 2.071e8, "std_pa": 1e5, "error_percent": 0.05, "z": 1.0, "gate_passed": True}
    circuit = {**circuit_studies(parts.CIRCUIT_RIG, SMALL.seed, SMALL)}
    circuit["figure 11 modelled chambers"] = lambda: pd.DataFrame(
        [{"condition": condition, **chambers} for condition in CONDITIONS]
    )
    printed = printed_equations(parts.NINE_RIG, SMALL)
    made: Mapping[str, Callable[[], Tables]] = {
        "study": lambda: {**study.frames, "printed equations": printed},
        "circuit": lambda: {name: make() for name, make in circuit.items()},
        "piezo-stack": lambda: {**stack_tables, "figure 12 left out": figure_12_left_out(parts.STACK_RIG, 7, 1, 1)},
        "diaphragm-motor": lambda: motor_tables,
        "motor-paper": lambda: motor_paper_tables,
    }
    found = {name: lambda _, __, make=make: make() for name, make in made.items()}
    monkeypatch.setattr(parts, "PARTS", {**parts.PARTS, **found})
    page_of_the_papers(tmp_path)
