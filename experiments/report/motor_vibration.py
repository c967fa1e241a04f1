"""Sections on the diaphragm-motor paper's linear models: poles, responses, loop, hysteresis, fractional damping."""

from collections.abc import Mapping, Sequence

import pandas as pd
from markupsafe import Markup

from experiments.figures.motor_vibration import VIBRATION_FIGURES
from experiments.report.sectioned import Section
from experiments.report.tables import Column, html_table, yes_or_no

Tables = Mapping[str, pd.DataFrame]


def vibration_sections(tables: Tables, figures: Mapping[str, bytes]) -> Sequence[Section]:
    """Return the sections on the paper's linear models.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The study's tables.
    figures : Mapping[str, bytes]
        SVG files, by name.

    Returns
    -------
    sequence of Section
        Poles, responses, the loop, hysteresis and fractional damping.
    """
    beside = {
        "bode": [_tuning(tables["tuning"])],
        "poles": [_poles(tables["poles"]), _margins(tables["margins"])],
        "loop": [_loop(tables["loop"]), _relay(tables["relay"])],
        "hysteresis_loops": [_hysteresis(tables["hysteresis"])],
    }
    said = {
        "bode": (
            "Diaphragms, fluid and load as springs, the piston as mass. With the signs mended the first mode is at "
            "480 Hz. The model gives the alternating motion only: nothing in it rectifies, so it has no mean velocity. "
            "Its natural frequency rises with the load's stiffness, as the paper argues; the best frequency of the "
            "motor that pumps does not (errata M31).",
        ),
        "poles": (
            "The loop around both masses is unstable at a gain of 1 although each Bode curve looks harmless at 480 Hz: "
            "the undamped mode at 4.5 kHz turns too far. A grid of frequencies that misses this mode counts no turns.",
        ),
    }
    return [
        Section(
            name,
            kind.heading,
            said.get(name, ()),
            figure=figures[name],
            caption=kind.caption,
            tables=beside.get(name, ()),
        )
        for name, kind in VIBRATION_FIGURES.items()
    ]


def _poles(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("model", "model"),
        Column("real_rad_s", "real part", "1/s"),
        Column("imaginary_rad_s", "imaginary part", "rad/s", digits=5),
        Column("frequency_hz", "frequency", "Hz"),
        Column("damping_ratio", "damping ratio", digits=3),
        Column("stable", "stable", words=yes_or_no),
    )
    return html_table(frame, columns, "Poles, one of each pair.")


def _margins(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("model", "model"),
        Column("gain_margin", "gain margin", digits=3),
        Column("phase_margin_deg", "phase margin", "°", digits=3),
        Column("crossover_hz", "at", "Hz"),
        Column("open_unstable_poles", "unstable poles", digits=1),
        Column("turns", "clockwise turns", digits=1),
        Column("closed_unstable_poles", "unstable poles, closed", digits=1),
        Column("stable", "stable, closed", words=yes_or_no),
    )
    return html_table(frame, columns, "Loops with a gain of 1 at rest; a dash: no finite gain margin.")


def _tuning(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("changed", "changed", words=lambda name: str(name).replace("_", " ")),
        Column("factor", "times", digits=2),
        Column("frequency_hz", "first mode", "Hz"),
        Column("damping_ratio", "damping ratio", digits=3),
        Column("peak_gain", "peak over rest", digits=3),
        Column("decay_time_s", "decay to a tenth", "ms", 1e3, digits=3),
    )
    return html_table(frame, columns, "Stiffness and damping tuned, one at a time, equation 4.")


def _loop(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("controller", "controller"),
        Column("overshoot_percent", "overshoot", "%", digits=3),
        Column("settling_time_s", "settles within", "ms", 1e3, digits=3),
        Column("error_percent", "error left", "%", digits=2),
        Column("ripple_m", "ripple", "nm", 1e9, digits=2),
    )
    return html_table(frame, columns, "A step of 20 µm; settled is within 5 % of the value that is reached.")


def _relay(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("quantity", "quantity"),
        Column("relay", "found by a relay in the loop"),
        Column("model", "from the model"),
        Column("unit", "unit"),
    )
    return html_table(frame, columns, "Where a proportional loop would swing for ever.")


def _hysteresis(frame: pd.DataFrame) -> Markup:
    columns = (
        Column("law", "law"),
        Column("frequency_hz", "frequency", "Hz"),
        Column("area_v2", "area", "V²"),
        Column("width_percent", "width", "% of stroke", digits=3),
        Column("gain", "gain of the first harmonic"),
        Column("lag_deg", "lag", "°", digits=3),
        Column("distortion_percent", "harmonic distortion", "%", digits=2),
    )
    return html_table(frame, columns, "Loops of 100 V.")
