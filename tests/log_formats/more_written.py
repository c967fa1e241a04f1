"""More ways to write a log, as by oscilloscopes, LabVIEW, dSPACE, catman, Fortran, NumPy and scripts."""

import json
import pickle
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pandas as pd

from tests.log_formats.written import ENGLISH, NOON, SI, Way, benched, csv, text

BARE = tuple(name.split(" [")[0] for name in ENGLISH)
UNITS = tuple(name[:-1].split(" [")[1] for name in ENGLISH)


def body(log: pd.DataFrame, sep: str, **how: Any) -> str:
    return benched(log).to_csv(index=False, header=False, sep=sep, **how)


def tabbed(*rows: Sequence[object]) -> str:
    return "".join("\t".join(map(str, row)) + "\t\n" for row in rows)


def of_labview(x_columns: str, rows: Iterable[str]) -> str:
    """Return a LabVIEW measurement file: two headers, and the names."""
    ended = ["***End_of_Header***"]
    above = tabbed(["LabVIEW Measurement"], ["Separator", "Tab"], ["X_Columns", x_columns], ended, [])
    above += tabbed(
        ["Samples", *[4000] * 4], ["Y_Unit_Label", *UNITS[1:]], ["X0", *[0.0] * 4], ["Delta_X", *[1e-3] * 4]
    )
    names = "\t".join(["X_Value", *BARE[1:], "Comment"])
    return above + tabbed(ended) + f"{names}\n" + "".join(f"{row}\t\n" for row in rows)


def labview(log: pd.DataFrame, folder: Path) -> Path:
    return text(folder / "log.lvm", of_labview("One", body(log, "\t").splitlines()))


def labview_without_x(log: pd.DataFrame, folder: Path) -> Path:
    rows = (line[line.index("\t") :] for line in body(log, "\t").splitlines())
    return text(folder / "log.lvm", of_labview("No", rows))


def dspace(log: pd.DataFrame, folder: Path) -> Path:
    from scipy.io import savemat

    made = benched(log)
    times = np.zeros(1, dtype=[("Name", object), ("Unit", object), ("Data", object)])
    times[0] = ("HostService", "s", made[ENGLISH[0]].to_numpy()[None, :])
    signals = np.zeros(4, dtype=[("Name", object), ("Unit", object), ("Data", object), ("XIndex", object)])
    for place, (full, bare, unit) in enumerate(list(zip(ENGLISH, BARE, UNITS, strict=True))[1:]):
        signals[place] = (bare, unit, made[full].to_numpy()[None, :], 1.0)
    savemat(folder / "rec1.mat", {"rec1_001": {"X": times, "Y": signals, "Description": "bench"}})
    return folder / "rec1.mat"


def oscilloscope(log: pd.DataFrame, folder: Path) -> Path:
    made = benched(log)
    made[ENGLISH[0]] *= 1e3
    above = f"{','.join(BARE)}\n(ms),{','.join(f'({unit})' for unit in UNITS[1:])}\n\n"
    return text(folder / "scope.csv", above + made.to_csv(index=False, header=False))


def catman(log: pd.DataFrame, folder: Path) -> Path:
    names = ["Zeit  1 - Standardmessrate", "Motordrehzahl", "Weg", "Geschwindigkeit", "Differenzdruck"]
    lines = ["CATMAN", "Datei: Versuch7.asc", "Kanäle: 5", "", "\t".join(names), "s\tU/min\tmm\tmm/s\tbar"]
    above = "\n".join([*lines, "\t".join(["MX840"] * 5), ""])
    return text(folder / "log.asc", above + body(log, "\t", decimal=",", lineterminator="\r\n"), "cp1252")


def merged_heading(log: pd.DataFrame, folder: Path) -> Path:
    from openpyxl import Workbook

    book = Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append(["Test 7"])
    sheet.merge_cells("A1:F1")
    sheet.append([])
    sheet.append([*BARE, "Power"])
    sheet.append([*UNITS, "W"])
    for place, row in enumerate(benched(log).to_numpy().tolist()):
        sheet.append([*row, f"=B{place + 5}*E{place + 5}"])
    book.save(folder / "log.xlsx")
    return folder / "log.xlsx"


def bus(log: pd.DataFrame, folder: Path) -> Path:
    from asammdf import MDF, Signal

    made, time = benched(log), log["time_s"].to_numpy()
    with MDF(version="4.10") as file:
        named = list(zip(ENGLISH, BARE, UNITS, strict=True))[1:]
        signals = [
            Signal(made[f].to_numpy(), time, unit=u, name=f"CAN1.EHA.{b.replace(' ', '_')}") for f, b, u in named
        ]
        file.append(signals, acq_name="CAN1")
        file.save(folder / "bus.mf4", overwrite=True)
    return folder / "bus.mf4"


def nanoseconds(log: pd.DataFrame, folder: Path) -> Path:
    made = benched(log)
    made.insert(0, "timestamp_ns", NOON.value + np.rint(1e9 * log["time_s"]).astype("int64"))
    made.drop(columns=ENGLISH[0]).to_parquet(folder / "log.parquet")
    return folder / "log.parquet"


def day_and_time(log: pd.DataFrame, folder: Path) -> Path:
    stamps = NOON + pd.to_timedelta(np.rint(1e3 * log["time_s"]), unit="ms")
    made = benched(log).drop(columns=ENGLISH[0])
    made.insert(0, "Time", stamps.dt.strftime("%H:%M:%S.%f"))
    made.insert(0, "Date", stamps.dt.strftime("%d.%m.%Y"))
    return text(folder / "day.csv", csv(made))


def stamp_and_seconds(log: pd.DataFrame, folder: Path) -> Path:
    made = benched(log)
    made.insert(0, "Stamp", (NOON + pd.to_timedelta(log["time_s"], unit="s")).dt.strftime("%Y-%m-%d %H:%M:%S"))
    return text(folder / "both.csv", csv(made))


def fortran(log: pd.DataFrame, folder: Path) -> Path:
    rows = ("  ".join(f"{value:.12E}".replace("E", "D") for value in row) for row in log.to_numpy())
    return text(folder / "log.dat", f"# {' '.join(SI)}\n" + "\n".join(rows) + "\n")


def archive(log: pd.DataFrame, folder: Path) -> Path:
    np.savez_compressed(folder / "log.npz", **{name: log[name].to_numpy() for name in SI})
    return folder / "log.npz"


def records(log: pd.DataFrame, folder: Path) -> Path:
    np.save(folder / "log.npy", log.to_records(index=False))
    return folder / "log.npy"


def json_lines(log: pd.DataFrame, folder: Path) -> Path:
    rows = (json.dumps(row) for row in log.to_dict("records"))
    return text(folder / "log.jsonl", "\n".join(rows) + '\n{"time_s": 4.0, "motor_sp')


def json_rows(log: pd.DataFrame, folder: Path) -> Path:
    return text(folder / "log.json", json.dumps({"data": log.to_dict("records")}))


def json_columns(log: pd.DataFrame, folder: Path) -> Path:
    return text(folder / "log.json", json.dumps(log.to_dict("list"), indent=1))


def json_split(log: pd.DataFrame, folder: Path) -> Path:
    return text(folder / "log.json", json.dumps([list(SI), *log.to_numpy().tolist()]))


def days_of_excel(log: pd.DataFrame, folder: Path) -> Path:
    made = benched(log)
    made.insert(0, "Time", (46082.5 + log["time_s"] / 86400.0).map("{:.14f}".format))
    return text(folder / "days.csv", csv(made.drop(columns=ENGLISH[0])))


def dates_of_matlab(log: pd.DataFrame, folder: Path) -> Path:
    made = benched(log).drop(columns=ENGLISH[0])
    made.insert(0, "Time", (NOON + pd.to_timedelta(log["time_s"], unit="s")).dt.strftime("%d-%b-%Y %H:%M:%S.%f"))
    return text(folder / "timetable.txt", csv(made))


def swedish(log: pd.DataFrame, folder: Path) -> Path:
    return text(folder / "svensk.csv", csv(benched(log), sep=";", decimal=",").replace("-", "\u2212"))


def half_days(log: pd.DataFrame, folder: Path) -> Path:
    begun = pd.Timestamp("2026-03-01 12:59:59")
    made = benched(log).drop(columns=ENGLISH[0])
    made.insert(0, "Time", (begun + pd.to_timedelta(log["time_s"], unit="s")).dt.strftime("%I:%M:%S.%f"))
    return text(folder / "clock.csv", csv(made))


def pickled(log: pd.DataFrame, folder: Path) -> Path:
    (folder / "log.pkl").write_bytes(pickle.dumps({name: log[name].to_numpy() for name in SI}))
    return folder / "log.pkl"


def open_document(_: pd.DataFrame, folder: Path) -> Path:
    with ZipFile(folder / "log.ods", "w") as file:
        file.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        file.writestr("content.xml", "<office/>")
    return folder / "log.ods"


MORE: Mapping[str, Way] = {
    "LabVIEW measurement": Way(labview),
    "LabVIEW measurement without X": Way(labview_without_x),
    "dSPACE recording": Way(dspace),
    "oscilloscope, ms in brackets": Way(oscilloscope),
    "catman": Way(catman, inspected=True),
    "Excel, merged heading and a formula": Way(merged_heading),
    "MDF with a bus before the names": Way(bus, inspected=True),
    "Parquet, nanoseconds since 1970": Way(nanoseconds, inspected=True),
    "day and time apart": Way(day_and_time),
    "stamps and seconds": Way(stamp_and_seconds),
    "Fortran's exponents": Way(fortran),
    "npz": Way(archive),
    "npy of records": Way(records),
    "JSON lines, the last cut": Way(json_lines),
    "JSON, an object a row": Way(json_rows),
    "JSON, a list a column": Way(json_columns),
    "JSON, names and lists": Way(json_split),
    "days as Excel counts them": Way(days_of_excel),
    "dates of a MATLAB timetable": Way(dates_of_matlab),
    "Swedish minus": Way(swedish),
    "a clock of twelve hours": Way(half_days),
    "pickle": Way(pickled, refused="a pickle may run any program .* save the log as"),
    "OpenDocument": Way(open_document, refused="OpenDocument .* save it as"),
}
"""Each way, by its description."""
