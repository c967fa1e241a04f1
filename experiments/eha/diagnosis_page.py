"""The page on one log: verdict, what to do, severities with limits, measured against fitted, the log itself."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from estimation.notes import EstimateCode
from experiments.eha.plain_verdict import (
    causes,
    confidence_cost_onset,
    is_doubted,
    is_of_another_size,
    separate_reasons,
    verdict,
    what_to_do,
)
from experiments.eha.verdict_words import (
    SEVERITY_NAMES,
    bulk_modulus_doubts,
    library_sentence,
    ranked_shares,
    severity_text,
)
from experiments.log_pages.channel_charts import channel_charts
from experiments.page.charts import Charts
from experiments.page.numbers import MINUS, percent_text
from experiments.page.panels import Curve, Mark, Panel
from experiments.page.render import render_page
from experiments.page.sentences import rig_advice, sentence
from experiments.page.severity_rows import severity_rows
from experiments.page.words import condition_in_words
from faults.diagnosis.circuits.blocks import blocks_of

if TYPE_CHECKING:
    from estimation.finding import Finding
    from plant.log.record import Record

CHANNELS = (("velocity", "mm/s", 1e3), ("pressure", "bar", 1e-5))
"""Channels that a circuit is fitted to: name, unit shown and factor from SI."""

LEAST_SHARE = 0.0005
"""Probability below which a condition is described as having almost none [probability]."""


def diagnosis_page(result: Mapping[str, Any], found: "Finding", record: "Record") -> str:
    """Return the page on a log.

    Parameters
    ----------
    result : Mapping
        Entries of the diagnosis, and ``file``.
    """
    name = Path(result["file"]).name
    shares = ranked_shares(found.probabilities, unknown=found.unknown)
    facts = {
        "result": result,
        "file": name,
        "title": verdict(result),
        "to_do": what_to_do(result),
        "describe": rig_advice(result),
        "sureness": confidence_cost_onset(result),
        "reasons": separate_reasons(result),
        "another_size": is_of_another_size(result),
        "library": library_sentence(result),
        "not_told": []
        if is_doubted(result)
        else [sentence(said) for said in (*bulk_modulus_doubts(result), *result["not_told"], *_to_measure(result))],
        "warnings": [sentence(said) for said in _chart_notes(result)],
        "shares": [
            (condition_in_words(condition), 100.0 * share, percent_text(share), share < LEAST_SHARE)
            for condition, share in shares
        ],
        "rows": severity_rows(found.severities, found.healthy, found.evidence.diagnosis.limits, SEVERITY_NAMES),
        "amounts": {name: severity_text(one).replace("-", MINUS) for name, one in result["severity"].items()},
        "not_determined": [
            SEVERITY_NAMES[name].removesuffix(", at most")
            for name, one in found.severities.items()
            if one.value is None
        ],
        "changed": found.since is not None,
        "charts": {
            "fit": fit_charts(found, Path(name).stem),
            "measured": channel_charts(record, found, Path(name).stem),
        },
    }
    return render_page("eha/diagnosis.html", facts, {}, {})


def _to_measure(result: Mapping[str, Any]) -> list[str]:
    """Return which entry of the rig file to measure for surer numbers."""
    return [one["text"] for one in result["notes"] if one["code"] == EstimateCode.KNOWN_AS_THE_RIG]


def _chart_notes(result: Mapping[str, Any]) -> list[str]:
    """Return the notes below the charts, which the opening does not contain."""
    warned = list(result.get("warnings", []))
    if not result["unknown"]:
        return warned
    reasons, told = result["reasons"], causes(result)
    return [one for one in reasons if one not in told] + [one for one in warned if one not in reasons]


def fit_charts(found: "Finding", stem: str) -> Charts:
    """Return charts of measurement, fitted circuit and residual, as means over 10 ms.

    Parameters
    ----------
    found : Finding
        Its evidence holds a diagnosis.
    stem : str
        File name of a download, without extension.
    """
    board = found.evidence.diagnosis.scoreboard
    blocks, fit = blocks_of(board.window), board.fits.best
    time = board.window.start_time + (np.arange(len(blocks.velocity)) + 0.5) * blocks.block * blocks.sample_time
    onset = () if board.onset is None else (Mark("x", float(board.onset.since), "change"),)
    panels: list[Panel] = []
    for i, (name, unit, scale) in enumerate(CHANNELS[: blocks.outputs.shape[1]]):
        measured, fitted = scale * blocks.outputs[:, i], scale * fit.fitted[:, i]
        left = np.where(np.arange(len(time)) < blocks.first, np.nan, measured - fitted)
        both = Curve("measured", measured, "blue"), Curve("fitted", fitted, "orange")
        panels.append(Panel(name, unit, both, onset))
        panels.append(Panel(f"{name}, residual", unit, (Curve("measured minus fitted", left, "grey"),), onset))
    return Charts(time, "time [s]", panels, f"{stem}-fit")
