"""27 ways to write one log, each with the library that benches and scripts use for it."""

import gzip
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

RPM = 60.0 / (2.0 * np.pi)
T = 1e-3
NOON = pd.Timestamp("2026-03-01 12:00:00")

GERMAN = ("Zeit [s]", "n_Mot [U/min]", "Weg [mm]", "Geschwindigkeit [mm/s]", "p_diff [bar]")
ENGLISH = ("Time [s]", "Motor speed [rpm]", "Position [mm]", "Velocity [mm/s]", "Differential pressure [bar]")
SI = ("time_s", "motor_speed_rad_s", "position_m", "velocity_m_s", "differential_pressure_pa")


@dataclass(frozen=True)
class Way:
    """A way to write a log: a function that writes it, and the options needed to read it."""

    write: Callable[[pd.DataFrame, Path], Path]
    options: Mapping[str, Any] = field(default_factory=dict)
    inspected: bool = False
    refused: str = ""


def benched(log: pd.DataFrame, names: tuple[str, ...] = ENGLISH) -> pd.DataFrame:
    """Return the log in the units of a bench."""
    scale = (1.0, RPM, 1e3, 1e3, 1e-5)
    return pd.DataFrame({name: log[si] * by for name, si, by in zip(names, SI, scale, strict=True)})


def text(path: Path, content: str, encoding: str = "utf-8") -> Path:
    path.write_bytes(content.encode(encoding))
    return path


def csv(log: pd.DataFrame, **how: Any) -> str:
    return log.to_csv(index=False, **how)


def plain(log: pd.DataFrame, folder: Path) -> Path:
    return text(folder / "plain.csv", csv(log))


def brackets(log: pd.DataFrame, folder: Path) -> Path:
    return text(folder / "brackets.csv", csv(benched(log)))


def tabs(log: pd.DataFrame, folder: Path) -> Path:
    return text(folder / "tabs.tsv", csv(benched(log), sep="\t"))


def decimal_comma(log: pd.DataFrame, folder: Path) -> Path:
    return text(folder / "comma.csv", csv(benched(log, GERMAN), sep=";", decimal=","))


def preamble(log: pd.DataFrame, folder: Path) -> Path:
    above = "Test bench 3\nOperator;A. N. Other\nSample rate;1000\n\n"
    return text(folder / "preamble.txt", above + csv(benched(log), sep=";"))


def units_row(log: pd.DataFrame, folder: Path) -> Path:
    lines = csv(benched(log, ("Time", "Motor speed", "Position", "Velocity", "Differential pressure"))).splitlines()
    return text(folder / "units.csv", "\n".join([lines[0], "s,rpm,mm,mm/s,bar", *lines[1:]]))


def stamped(log: pd.DataFrame) -> pd.DataFrame:
    dated = benched(log)
    dated.insert(0, "Timestamp", NOON + pd.to_timedelta(np.rint(log["time_s"] * 1e9).astype("int64"), unit="ns"))
    return dated.drop(columns="Time [s]")


def dates(log: pd.DataFrame, folder: Path) -> Path:
    return text(folder / "dates.csv", csv(stamped(log), date_format="%Y-%m-%d %H:%M:%S.%f"))


def zones(log: pd.DataFrame, folder: Path) -> Path:
    zoned = stamped(log)
    zoned["Timestamp"] = [f"{one.isoformat(timespec='microseconds')}+02:00" for one in zoned["Timestamp"]]
    return text(folder / "zones.csv", csv(zoned))


def german_dates(log: pd.DataFrame, folder: Path) -> Path:
    dated = stamped(log)
    dated["Timestamp"] = dated["Timestamp"].dt.strftime("%d.%m.%Y %H:%M:%S,%f")
    return text(folder / "german.csv", csv(dated, sep=";", decimal=","))


def utf16(log: pd.DataFrame, folder: Path) -> Path:
    return text(folder / "utf16.txt", csv(benched(log), sep="\t"), "utf-16")


def gzipped(log: pd.DataFrame, folder: Path) -> Path:
    (folder / "log.csv.gz").write_bytes(gzip.compress(csv(benched(log)).encode()))
    return folder / "log.csv.gz"


def zstd(log: pd.DataFrame, folder: Path) -> Path:
    with pa.CompressedOutputStream(str(folder / "log.csv.zst"), "zstd") as file:
        file.write(csv(benched(log)).encode())
    return folder / "log.csv.zst"


def xlsx(log: pd.DataFrame, folder: Path) -> Path:
    sheets = {"Info": pd.DataFrame({"what": ["bench"], "value": ["3"]}), "Data": benched(log)}
    with pd.ExcelWriter(folder / "log.xlsx", engine="openpyxl") as book:
        for name, sheet in sheets.items():
            sheet.to_excel(book, sheet_name=name, index=False)
    return folder / "log.xlsx"


def tdms(log: pd.DataFrame, folder: Path) -> Path:
    from nptdms import ChannelObject, TdmsWriter

    units = {"wf_increment": T, "wf_start_offset": 0.0}
    made = benched(log)
    with TdmsWriter(folder / "log.tdms") as file:
        for name in ENGLISH[1:]:
            bare, unit = name[:-1].split(" [")
            file.write_segment([ChannelObject("Bench", bare, made[name].to_numpy(), {"unit_string": unit, **units})])
    return folder / "log.tdms"


def mdf4(log: pd.DataFrame, folder: Path) -> Path:
    from asammdf import MDF, Signal

    made, time = benched(log), log["time_s"].to_numpy()
    signals = [
        Signal(made[name].to_numpy(), time, unit=name[:-1].split(" [")[1], name=name.split(" [")[0])
        for name in ENGLISH[1:]
    ]
    with MDF(version="4.10") as file:
        file.append(signals)
        file.save(folder / "log.mf4", overwrite=True)
    return folder / "log.mf4"


def mat5(log: pd.DataFrame, folder: Path) -> Path:
    from scipy.io import savemat

    savemat(folder / "log.mat", {"data": {name: log[name].to_numpy() for name in SI}}, do_compression=True)
    return folder / "log.mat"


def mat4(log: pd.DataFrame, folder: Path) -> Path:
    from scipy.io import savemat

    savemat(folder / "log4.mat", {name: log[[name]].to_numpy() for name in SI}, format="4")
    return folder / "log4.mat"


def modelica(log: pd.DataFrame, folder: Path) -> Path:
    """Write a log as OpenModelica does, with one signal as an alias of the opposite sign."""
    from scipy.io import savemat

    def turned(texts: list[str]) -> np.ndarray:
        return np.array(["".join(row) for row in zip_longest(*texts, fillvalue=" ")])

    signals = {name: log[name].to_numpy() for name in SI}
    names, said = ["rod.m", *signals], ["Mass of the rod [kg]", *("said of it" for _ in signals)]
    info = np.array([[1, 2, 0, -1], *([0 if name == "time_s" else 2, k, 0, -1] for k, name in enumerate(signals, 1))])
    courses = np.vstack(list(signals.values()))
    info[-1, 1] *= -1
    courses[-1] *= -1.0
    content = {"Aclass": np.array(["Atrajectory", "1.1        ", " " * 11, "binTrans   "])}
    content |= {"name": turned(names), "description": turned(said), "dataInfo": info.T.astype(np.int32)}
    content |= {"data_1": np.array([[0.0, log["time_s"].iloc[-1]], [7.4, 7.4]]), "data_2": courses}
    savemat(folder / "rod_res.mat", content, format="4")
    return folder / "rod_res.mat"


def mat73(log: pd.DataFrame, folder: Path) -> Path:
    import h5py

    path = folder / "log73.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name in SI:
            made = file.create_dataset(f"data/{name}", data=log[name].to_numpy()[None, :])
            made.attrs["MATLAB_class"] = np.bytes_("double")
    content = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    with path.open("r+b") as file:
        file.write(content)
    return path


def simulink(log: pd.DataFrame, folder: Path) -> Path:
    from scipy.io import savemat

    signals = np.zeros(4, dtype=[("values", object), ("label", object)])
    for place, name in enumerate(SI[1:]):
        signals[place] = (log[name].to_numpy()[:, None], name)
    savemat(folder / "out.mat", {"out": {"time": log["time_s"].to_numpy(), "signals": signals}})
    return folder / "out.mat"


def hdf5(log: pd.DataFrame, folder: Path) -> Path:
    import h5py

    with h5py.File(folder / "log.h5", "w") as file:
        for name, values in benched(log).items():
            bare, unit = str(name)[:-1].split(" [")
            file.create_dataset(f"run1/{bare}", data=values.to_numpy()).attrs["unit"] = unit
    return folder / "log.h5"


def parquet(log: pd.DataFrame, folder: Path) -> Path:
    stamped(log).set_index("Timestamp").to_parquet(folder / "log.parquet")
    return folder / "log.parquet"


def feather(log: pd.DataFrame, folder: Path) -> Path:
    benched(log).to_feather(folder / "log.feather")
    return folder / "log.feather"


def two_loggers(log: pd.DataFrame, folder: Path) -> Path:
    made = benched(log)
    text(folder / "pressure.csv", csv(made[["Time [s]", "Differential pressure [bar]"]]))
    return text(folder / "motion.csv", csv(made.drop(columns="Differential pressure [bar]")))


def rounded(log: pd.DataFrame, folder: Path) -> Path:
    made = benched(log)
    made["Time [s]"] = made["Time [s]"].map("{:.2f}".format)
    return text(folder / "rounded.csv", csv(made))


def with_a_copied_row(log: pd.DataFrame, folder: Path) -> Path:
    made = benched(log)
    return text(folder / "copied.csv", csv(pd.concat([made[:700], made[699:]])))


def timeless(log: pd.DataFrame, folder: Path) -> Path:
    return text(folder / "timeless.csv", csv(log.drop(columns="time_s")))


def timetable(_: pd.DataFrame, folder: Path) -> Path:
    """Write a timetable as MATLAB's `save` does: an object whose class cannot be read."""
    from scipy.io import savemat

    savemat(folder / "timetable.mat", {"run": "a timetable"})
    return folder / "timetable.mat"


def zipped(log: pd.DataFrame, folder: Path) -> Path:
    from zipfile import ZipFile

    with ZipFile(folder / "log.zip", "w") as file:
        file.writestr("log.csv", csv(log))
    return folder / "log.zip"


WAYS: Mapping[str, Way] = {
    "CSV with SI names": Way(plain),
    "CSV with units in brackets": Way(brackets),
    "tabs": Way(tabs),
    "semicolons, decimal comma, German names": Way(decimal_comma, inspected=True),
    "lines above the header": Way(preamble),
    "a row of units": Way(units_row),
    "dates": Way(dates),
    "dates with a time zone": Way(zones),
    "German dates, decimal comma": Way(german_dates),
    "UTF-16": Way(utf16),
    "gzip": Way(gzipped),
    "zstd": Way(zstd),
    "Excel, second sheet": Way(xlsx),
    "TDMS with a step": Way(tdms),
    "MDF 4": Way(mdf4),
    "MAT 5, a struct": Way(mat5),
    "MAT 4": Way(mat4),
    "a simulation in Modelica": Way(modelica),
    "MAT 7.3": Way(mat73),
    "Simulink's structure with time": Way(simulink),
    "HDF5 with units as attributes": Way(hdf5),
    "Parquet, dates as index": Way(parquet),
    "Feather": Way(feather),
    "two loggers": Way(two_loggers, {"beside": ("pressure.csv",)}),
    "no time": Way(timeless, {"sample_time": T}),
    "a timetable of MATLAB's": Way(timetable, refused="can only be read by MATLAB: save its columns as"),
    "a zip archive": Way(zipped, refused="a zip archive is no log: unpack it first"),
}
"""Each way, by its description; 25 can be read, 2 are refused."""
