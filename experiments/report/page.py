"""The study's report: one HTML file that needs nothing beside it, written for a maintenance engineer."""

import re
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from experiments.figures import FIGURES
from experiments.report.errata import linked, linked_errata
from experiments.report.findings import (
    POSITION_SINE,
    POSITION_STEPS,
    PRESSURE_SINE,
    PRESSURE_STEPS,
    PUBLISHED_WAY,
    PUBLISHED_WAY_STUCK,
    class_accuracies,
    recoveries,
)
from experiments.report.sections import report_tables
from experiments.report.tables import exact, number
from experiments.report.verdict import verdict
from experiments.studies.settings import quick_settings
from experiments.study import StudyResult
from plant.sensors import BENCH

KEY_FIGURE = "convergence_pressure_form"
"""The figure of the first page."""


def render_report(result: StudyResult, figures: Mapping[str, bytes]) -> str:
    """Return the report as one HTML page with its figures inside.

    Parameters
    ----------
    result : StudyResult
        What a study found.
    figures : Mapping[str, bytes]
        SVG files by name, as in `FIGURES`.

    Returns
    -------
    str
        The page; it loads nothing.
    """
    environment = Environment(
        loader=PackageLoader("experiments.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"linked": linked, "number": number, "exact": exact}
    page = environment.get_template("report.html").render(_facts(result, figures), linked_errata=linked_errata)
    return re.sub(r"(?<=\d) (?=%|(?:V|Hz|kHz|mm|ms|psi)\b)", "\N{NO-BREAK SPACE}", page)


def _facts(result: StudyResult, figures: Mapping[str, bytes]) -> dict[str, Any]:
    found = recoveries(result.tables["bulk_modulus"])
    settings = result.manifest["settings"]
    rmse, order = result.tables["validation_rmse"], result.series["order"]
    published_better = rmse["published_rmse_mathematical_m_s"] < rmse["published_rmse_transfer_function_m_s"]
    return {
        "verdict": verdict(result),
        "key_figure": KEY_FIGURE,
        "figures": {name: _figure(name, svg) for name, svg in figures.items()},
        "tables": report_tables(result),
        "truth_pa": float(result.manifest["parameters"]["bulk_modulus"]),
        "published_way": found[PUBLISHED_WAY],
        "published_stuck": found[PUBLISHED_WAY_STUCK],
        "ours": (found[PRESSURE_SINE], found[PRESSURE_STEPS]),
        "position_steps": found[POSITION_STEPS],
        "position_sine": found[POSITION_SINE],
        "classes": class_accuracies(result.tables),
        "better": int(rmse["mathematical_is_better"].sum()),
        "published_better": int(published_better.sum()),
        "conditions": len(rmse),
        "suggested_order": int(order["suggested_order"].iloc[0]),
        "velocity_noise_m_s": BENCH.velocity_noise,
        "settings": settings,
        "quick": settings == asdict(quick_settings(int(settings["seed"]))),
    }


def _figure(name: str, svg: bytes) -> Markup:
    caption = FIGURES[name].caption
    image = Markup('<img alt="{}" src="data:image/svg+xml;base64,{}">').format(caption, b64encode(svg).decode("ascii"))
    return Markup('<figure id="figure-{}">{}<figcaption>{}</figcaption></figure>').format(name, image, linked(caption))
