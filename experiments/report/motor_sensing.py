"""Sections on velocity from sensing voltages, and on the spectra of the driven diaphragm motor."""

from collections.abc import Mapping, Sequence

import pandas as pd
from markupsafe import Markup

from experiments.figures.motor_sensing import SENSING_FIGURES
from experiments.report.sectioned import Section
from experiments.report.tables import Cell, Column, fixed, html_table

MILLI = 1e3


def sensing_sections(tables: Mapping[str, pd.DataFrame], figures: Mapping[str, bytes]) -> Sequence[Section]:
    """Return the sections on the regressions that the paper wanted, and on Figure 21.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.
    figures : Mapping[str, bytes]
        SVG files, by name.

    Returns
    -------
    sequence of Section
        One a figure.
    """
    beside = {
        "sensing": [_regressions(tables["sensing regressions"])],
        "sensing_faults": [_faults(tables["sensing faults"])],
        "spectra": [_distortion(tables["distortion"])],
    }
    said = {
        "sensing": (
            "On the simulated motor, with half a percent of noise. The three middle electrodes say the same thing: "
            "their variance inflation is in the thousands, coefficients have both signs, and together they explain "
            "little more than one of them alone. One middle electrode and the drive's voltage do it.",
            "Table 3's fifth rule would drop one of these two as well, for their inflation is about 5, and with it the "
            "fit: correlation does no harm where each has a meaning of its own. Data and regression come from one "
            "model here; on a bench, fit again.",
        ),
    }
    return [
        Section(name, kind.heading, said.get(name, ()), figure=figures[name], caption=kind.caption, tables=beside[name])
        for name, kind in SENSING_FIGURES.items()
    ]


def _regressions(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("regressors", "velocity from"),
        Column("r_square", "R²", words=lambda value: Cell(fixed(value, 3), "number")),
        Column("predictive_r_square", "R² left out", words=lambda value: Cell(fixed(value, 3), "number")),
        Column("error_m_s", "standard error", "mm/s", MILLI, digits=2),
        Column("largest_vif", "largest variance inflation", digits=2),
        Column("smallest_coefficient", "smallest coefficient", "mm/s a volt", MILLI, digits=2),
        Column("largest_coefficient", "largest", "mm/s a volt", MILLI, digits=2),
    )
    return html_table(frame, columns, "Regressions on thirty points; R² left out is of each point from the others.")


def _faults(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("fault", "fault"),
        Column("velocity_m_s", "velocity", "mm/s", MILLI, digits=3),
        *(Column(name, name, "mm/s off", MILLI, digits=2) for name in frame.columns[2:].tolist()),
    )
    return html_table(frame, columns, "Error of each regression at 200 V and 10 N, without noise.")


def _distortion(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("signal", "signal", words=lambda name: str(name).split(" [")[0]),
        *(Column(name, f"{name.removeprefix('thd_')} V", "%", digits=2) for name in frame.columns[1:].tolist()),
    )
    return html_table(frame, columns, "Total harmonic distortion by drive, peak to peak.")
