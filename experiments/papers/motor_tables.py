"""Tables 1, 2, 4 and 5 of the diaphragm-motor paper and the regression of its Figure 12, cell by cell."""

from collections.abc import Iterator
from functools import partial

import numpy as np
import pandas as pd

from experiments.diaphragm_motor.quoted import ML_MIN
from experiments.diaphragm_motor.sweeps import SWING
from experiments.motor_paper.tables import LARGEST_SCATTER_PERCENT
from experiments.page.frames import Tables, cell
from experiments.papers.parts import Evidence
from experiments.papers.verdict import OurResult, Row, number_row
from experiments.published import as_printed
from plant.diaphragm_motor.composite_plate import PlateParameters
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters

PAPER, VERB = "001", "hydrostate motor-paper"

ACTUATORS = "Another device, of which we have no model."


def motor_table_rows(found: Evidence) -> Iterator[Row]:
    """Yield a row for every table cell that this project computes or was given."""
    paper = found["motor-paper"]
    yield from _sizes(paper["table_1"])
    yield from _relations(paper["table_2"])
    yield from _figure_12(paper["regression"], paper["regression_residuals"])
    yield from _table_4(paper["table_4"])
    yield from _table_5(found["diaphragm-motor"], paper["table_2"])


_row = partial(number_row, PAPER, shown_by=VERB)


def _sizes(table: pd.DataFrame) -> Iterator[Row]:
    plate = PlateParameters()
    given = {
        "substrate thickness": 1e3 * plate.brass_thickness,
        "chamber height": 1e3 * DiaphragmMotorParameters().chamber_volume / (np.pi * plate.clamp_radius**2),
        "ceramic diameter": 2e3 * plate.ceramic_radius,
        "ceramic thickness": 1e3 * plate.ceramic_thickness,
    }
    remarks = table.set_index("item")["remark"]
    for row in as_printed("table1_geometry").to_dict("records"):
        item, printed = row["item"], row["value"]
        note = str(remarks[item]) if isinstance(remarks[item], str) else ""
        ours = OurResult(given.get(item))
        note = note or ("" if item in given else "No part of a model of ours.")
        yield _row("Table 1", item, printed, row["unit"], "digits", ours, note=note, basis="target")


def _relations(ours: pd.DataFrame) -> Iterator[Row]:
    """Yield the columns of Table 2 that follow from equations or other tables, with the rows' median constant."""
    printed, accept = as_printed("table2"), f"± {LARGEST_SCATTER_PERCENT:g} %"
    constants = ours.median()
    relations = (
        ("diaphragm_area_mm2", "area_ratio", "mm²", "(3) area, from the diameter", "M23"),
        ("displacement_u_mm", "displacement_ratio", "mm", "(5) displacement, 45.6 times the frequency", "M23"),
        ("output_flow_qg", "efficiency", "mmL/s", "(7) flow, by equation 17 and one efficiency, √5", "M17"),
        ("fluid_velocity_v", "piston_area_cm2", "mm/s", "(11) velocity, by equation 18 and one piston", "M24"),
        (
            "deformation_delta_mm",
            "d31_pm_v",
            "mm",
            "(10) deformation, by equation 14, one d_31 and Table 5's voltage",
            "M14",
        ),
        ("blocking_force_fmax", "force_ratio", "kg/m²", "(9) blocking force, a tenth of Table 5's", "M23"),
    )
    notes = {
        "efficiency": "h_31 is deformation over voltage, times 1000; row 1's diameter is its area's (errata M17).",
        "piston_area_cm2": "Row 3's velocity read as 0.002585 (errata M18, M24).",
        "d31_pm_v": "The median of the six d_31; no one ceramic does it.",
    }
    physical = {(2, "fluid_velocity_v"): 2.585e-3}
    for column, ratio, unit, words, errata in relations:
        for k, text in enumerate(printed[column].tolist()):
            base = physical.get((k, column), float(text))
            off = cell(ours, k, ratio) / constants[ratio]
            # the velocity falls as the piston's area rises; the other constants rise with their column
            value = base * off if ratio == "piston_area_cm2" else base / off
            claim, note = f"{words}, row {k + 1}", notes.get(ratio, "")
            yield _row("Table 2", claim, text, unit, accept, OurResult(float(value)), errata=errata, note=note)
    yield from _layers(printed, accept)
    yield from _no_frequency(printed)


def _layers(printed: pd.DataFrame, accept: str) -> Iterator[Row]:
    """Yield the columns of Table 2 that Table 1 gives: diameter and thickness."""
    size = PlateParameters()
    total = 1e3 * size.thickness
    for k, row in enumerate(printed.to_dict("records")):
        diameter, thick = row["diaphragm_diameter_mm"], row["diaphragm_thickness_mm"]
        here = f"row {k + 1}, against Table 1's"
        yield _row(
            "Table 2",
            f"(1) diameter, {here} ceramic",
            diameter,
            "mm",
            accept,
            OurResult(2e3 * size.ceramic_radius),
            errata="M23",
        )
        yield _row("Table 2", f"(2) thickness, {here} two layers", thick, "mm", accept, OurResult(total), errata="M14")


def _no_frequency(printed: pd.DataFrame) -> Iterator[Row]:
    columns = (
        ("driving_frequency", "rad/s", "(4) driving frequency", "60 to 600 Hz are 377 to 3770 rad/s.", "M23"),
        ("driving_voltage_us", "V", "(6) driving voltage", "By equation 15 it is a sensing voltage.", "M15"),
        ("external_load_f", "kg/m²", "(8) external load", "Read as tens of newtons; nothing gives it.", "M23"),
    )  # fmt: skip
    for column, unit, words, note, errata in columns:
        for k, text in enumerate(printed[column].tolist()):
            claim = f"{words}, row {k + 1}; nothing printed gives it"
            yield _row("Table 2", claim, text, unit, "digits", OurResult(None), errata=errata, note=note)


def _figure_12(frame: pd.DataFrame, residuals: pd.DataFrame) -> Iterator[Row]:
    ours, note = frame.set_index("quantity"), "Table 2 read with row 6's flow 0.0868 and row 3's velocity 0.002585."
    for row in as_printed("fig12_anova").to_dict("records"):
        name, printed = row["quantity"], row["value"]
        claim = name.replace("_", " ")
        found = OurResult(cell(ours, name, "anova"))
        yield _row("Figure 12", claim, printed, "", "digits", found, note=note, errata="M24")
        if name != "observations":
            said = "Table 2 as printed."
            found = OurResult(cell(ours, name, "as_printed"))
            yield _row("Figure 12, from Table 2", claim, printed, "", "digits", found, note=said, errata="M24")
    rows = residuals[residuals["reading"] == "anova"].reset_index(drop=True)
    percentiles = ("8.333333333", "25", "41.66666667", "58.33333333", "75", "91.66666667")
    flows = ("0.0105", "0.0534", "0.0868", "0.1715", "0.175", "0.554")
    for k, (percentile, flow) in enumerate(zip(percentiles, flows, strict=True)):
        words = f"probability output, row {k + 1}"
        middle, sorted_flow = (OurResult(cell(rows, k, name)) for name in ("percentile", "sorted_flow"))
        yield _row("Figure 12", f"{words}, percentile", percentile, "", "digits", middle)
        yield _row("Figure 12", f"{words}, flow", flow, "mmL/s", "digits", sorted_flow, note=note, errata="M24")


def _table_4(ours: pd.DataFrame) -> Iterator[Row]:
    given = (
        ("theoretical_flow_ml_per_min", "theory_ml_per_min", "theoretical flow, a 38 mm piston", "± 0.01 %", "M29"),
        ("error_percent", "error_by_flowmeter_percent", "error between flow meter and theory", "digits", ""),
        ("measuring_cylinder_ml_per_min", "theory_ml_per_min", "measuring cylinder, against theory", "± 2 %", ""),
        ("flowmeter_ml_per_min", "theory_ml_per_min", "flow meter, against theory", "± 4 %", ""),
    )
    for k, row in enumerate(as_printed("table4_flow").to_dict("records")):
        for column, name, words, accept, errata in given:
            unit = "%" if column == "error_percent" else "mL/min"
            claim = f"{words}, {row['frequency_hz']} Hz, {row['pumping_displacement_mm']} mm"
            note = "Displacement read in µm; the theory of a piston pump, not of this motor (errata M29)."
            yield _row(
                "Table 4", claim, row[column], unit, accept, OurResult(cell(ours, k, name)), errata=errata, note=note
            )


def _table_5(motor: Tables, table_2: pd.DataFrame) -> Iterator[Row]:
    plant = _proposed(motor)
    columns = (
        ("voltage_vpp", "V", "voltage, peak to peak"),
        ("frequency_hz", "Hz", "working frequency"),
        ("no_load_velocity_mm_per_s", "mm/s", "maximum no-load velocity"),
        ("blocking_force_n", "N", "maximum blocking force"),
    )
    tenth = [float(text) for text in as_printed("table2")["blocking_force_fmax"]]
    for k, row in enumerate(as_printed("table5_actuators").to_dict("records")):
        ours_is_there = row["actuator"] == "the proposed actuator"
        for column, unit, words in columns:
            own = plant[column] if ours_is_there else OurResult(None)
            errata, note = ("M26", "Our plant, calibrated to 110.11 mL/min.") if ours_is_there else ("", ACTUATORS)
            yield _row(
                "Table 5",
                f"{words}, {row['actuator']}",
                row[column],
                unit,
                "± 5 %",
                own,
                basis="model",
                errata=errata,
                note=note,
                shown_by="hydrostate diaphragm-motor",
            )
        claim = f"maximum blocking force, {row['actuator']}, ten times Table 2's"
        found = OurResult(tenth[k] * float(table_2["force_ratio"].iloc[k]))
        yield _row("Table 5", claim, row["blocking_force_n"], "N", "digits", found)


def _proposed(motor: Tables) -> dict[str, OurResult]:
    flow = motor["frequency_sweep"].set_index("frequency_hz")["flow_m3_s"] / ML_MIN
    loads = motor["load_sweep"]
    most = loads[loads["voltage_v"] == loads["voltage_v"].max()]
    return {
        "voltage_vpp": OurResult(SWING),
        "frequency_hz": OurResult(float(str(flow.idxmax()))),
        "no_load_velocity_mm_per_s": OurResult(1e3 * float(most["velocity_m_s"].max())),
        "blocking_force_n": OurResult(float(most["blocking_n"].max())),
    }
