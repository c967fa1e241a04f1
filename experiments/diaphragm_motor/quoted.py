"""Claims in the text of the diaphragm-motor paper, compared with the plant."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from experiments.diaphragm_motor.sweeps import PEAK, SWING
from plant.diaphragm_motor.flow import operate
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import HIGHEST_VOLTAGE

ML_MIN = 1e-6 / 60.0
"""One millilitre per minute [m^3/s]."""

COLUMNS = ("section", "claim", "published", "ours", "holds")

Row = tuple[str, str, str, str, bool]


def straightness(x: pd.Series, y: pd.Series) -> float:
    """Return R^2 of a straight line.

    Parameters
    ----------
    x, y : pandas.Series
        The points [any unit].

    Returns
    -------
    float
        Squared correlation [dimensionless].

    Examples
    --------
    >>> round(straightness(pd.Series([0.0, 1.0, 2.0]), pd.Series([1.0, 3.0, 5.0])), 12)
    1.0
    """
    return float(np.corrcoef(x, y)[0, 1] ** 2)


def load_straightness(loads: pd.DataFrame, share: float) -> Mapping[float, float]:
    """Return the linearity of velocity over load, below a share of the blocking force.

    Parameters
    ----------
    loads : pandas.DataFrame
        The table ``load sweep``.
    share : float
        Share of the blocking force [dimensionless].

    Returns
    -------
    Mapping[float, float]
        R^2 by voltage peak to peak [V].
    """
    moving = loads[loads["load_n"] < share * loads["blocking_n"]]
    groups = moving.groupby("voltage_v")
    return {float(str(swing)): straightness(rows["load_n"], rows["velocity_m_s"]) for swing, rows in groups}


def claimed_speeds(p: DiaphragmMotorParameters) -> pd.DataFrame:
    """Return the velocities at the settings for which sections 7.2 and 7.3 print one.

    Returns
    -------
    pandas.DataFrame
        Columns section, frequency_hz, load_n, voltage_v, velocity_m_s (as simulated, negative if the load drives the
        piston back) and published_mm_s.
    """
    most = 2.0 * HIGHEST_VOLTAGE
    settings = (
        ("7.2", 200.0, 0.0, most, 4.8),
        ("7.2", 300.0, 50.0, most, 30.5),
        ("7.2", 600.0, 100.0, most, 168.1),
        ("7.3", 500.0, 0.0, 100.0, 30.5),
    )
    rows = [
        (section, f, load, volts, operate(replace(p, load_force=load), f, volts).velocity, published)
        for section, f, load, volts, published in settings
    ]
    names = ["section", "frequency_hz", "load_n", "voltage_v", "velocity_m_s", "published_mm_s"]
    return pd.DataFrame(rows, columns=names)


def root_efficiency(p: DiaphragmMotorParameters, sweep: pd.DataFrame) -> pd.DataFrame:
    """Return the efficiency that equation 17 would need with the root of seven (errata M17).

    Parameters
    ----------
    sweep : pandas.DataFrame
        The table ``frequency sweep``.

    Returns
    -------
    pandas.DataFrame
        Columns frequency_hz and efficiency [dimensionless].
    """
    frequencies = sweep["frequency_hz"].to_numpy(dtype=np.float64)
    eta = sweep["flow_m3_s"].to_numpy() / (np.sqrt(7.0) * p.volume_a_volt * SWING * frequencies)
    at = np.array([100.0, 300.0, 480.0, 800.0])
    return pd.DataFrame({"frequency_hz": at, "efficiency": np.interp(at, frequencies, eta)})


def claims_reproduced(tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return the claims of sections 7.1 to 7.3 that the plant can reproduce, with our results.

    Returns
    -------
    pandas.DataFrame
        Columns section, claim, published, ours, holds.
    """
    sweep = tables["frequency sweep"].set_index("frequency_hz")
    flow = sweep["flow_m3_s"] / ML_MIN
    best = float(str(flow.idxmax()))
    middle = {name: float(str(sweep[f"{name.lower()}_v"].idxmax())) for name in ("A3", "A4", "A5")}
    swings = tables["voltage sweep"]
    straight = {name: straightness(swings["voltage_v"], swings[f"{name.lower()}_v"]) for name in ("A3", "A4", "A5")}
    rising = all(bool(swings[name].is_monotonic_increasing) for name in swings.columns if name != "velocity_m_s")
    loads = tables["load sweep"]
    lines, whole = load_straightness(loads, 0.7), load_straightness(loads, 1.0).values()
    runs = tables["control"].set_index("run")
    rows: list[Row] = [
        ("7.1", "peak flow, 200 V [ml/min]", "110.11", f"{flow.max():.1f}", abs(flow.max() - 110.0) <= 2.0),
        ("7.1", "frequency of the peak [Hz]", "480", f"{best:.0f}", abs(best - PEAK) <= 10.0),
        ("7.1", "frequencies at which A3, A4, A5 peak [Hz]", "480", ", ".join(f"{f:.0f}" for f in middle.values()),
         all(abs(f - PEAK) <= 10.0 for f in middle.values())),
        ("7.1", "flow and sensing from 100 to 300 V", "rise", "rise" if rising else "do not", rising),
        ("7.3", "R² of A3, A4, A5 against voltage", "straight", f"{min(straight.values()):.4f} or more",
         min(straight.values()) > 0.99),
        ("4", "R² of velocity against load to 0.7 of blocking, 100, 200, 300 V", "straight",
         ", ".join(f"{value:.4f}" for value in lines.values()), min(lines.values()) > 0.999),
        ("4", "the same to 0.95 of blocking, where valves leak and friction smooths", "straight",
         ", ".join(f"{value:.4f}" for value in whole), min(whole) > 0.99),
        ("5.1", "the 4/3 valve reverses the piston", "yes", _yes_if_reversed(tables["reversal"]),
         _yes_if_reversed(tables["reversal"]) == "yes"),
        ("5.1", "velocity settles under PI, encoder and self-sensing [s]", "no figure",
         ", ".join(f"{runs.loc[name, 'rise_s']:.2f}" for name in ("encoder", "self-sensing")),
         bool((runs.loc[["encoder", "self-sensing"], ["settling_s", "rise_s"]] < 0.5).to_numpy().all())),
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _yes_if_reversed(course: pd.DataFrame) -> str:
    moved = course.groupby("spool")["position_m"].agg(lambda x: x.iloc[-1] - x.iloc[0])
    return "yes" if moved[1.0] > 0.0 > moved[-1.0] else "no"


def claims_not_reproduced(tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return the claims that the plant does not support, with its own results (errata M17, M25, M26, M31).

    Returns
    -------
    pandas.DataFrame
        Columns section, claim, published, ours, why.
    """
    most = 2.0 * HIGHEST_VOLTAGE
    free = 1e3 * tables["load and frequency"]["velocity_m_s"].max()
    blocked = tables["load sweep"].set_index("voltage_v")["blocking_n"].groupby(level=0).first()
    best = tables["load and frequency"].loc[
        tables["load and frequency"].groupby("load_n")["velocity_m_s"].idxmax(), "frequency_hz"
    ]
    sweep = tables["frequency sweep"].set_index("frequency_hz")
    frequencies = sweep.index.to_numpy(dtype=np.float64)
    efficiencies = tables["efficiency by the root of 7"]["efficiency"]
    first = np.interp((440.0, 480.0, 600.0), frequencies, sweep["a1_v"])
    *speeds, weak = 1e3 * tables["claimed speeds"]["velocity_m_s"]
    a4 = tables["voltage sweep"].set_index("voltage_v")["a4_v"]
    rows = [
        ("7.2, Table 5", "largest velocity [mm/s]", "168.1", f"{free:.1f} at {most:.0f} V",
         "110 ml/min on A_c of Table 2 is 4.8 mm/s (errata M26)"),
        ("Table 5", "blocking force [N]", "141", f"{blocked[SWING]:.0f} at 200 V, {blocked[most]:.0f} at {most:.0f} V",
         "141 N would take more voltage than the ceramic bears (errata M27)"),
        ("abstract", "drive [V]", "100 to 1000", f"refused above {most:.0f} peak to peak",
         "the ceramic depoles (errata M27)"),
        ("7.2", "best frequency at 0, 12.5, 25, 37.5 N [Hz]", "rises with load",
         ", ".join(f"{f:.0f}" for f in best), "it falls with load (errata M31)"),
        ("7.1", "A1's voltage at 440, 480, 600 Hz [V]", "rises with frequency",
         ", ".join(f"{value:.1f}" for value in first),
         "it peaks below the others' frequency (errata M31)"),
        ("4, equation 17", "efficiency by the root of 7 at 100, 300, 480, 800 Hz", "one number",
         ", ".join(f"{value:.2f}" for value in efficiencies),
         "it follows the frequency; the root of 5 or 7 is no law (errata M17)"),
        ("7.2", f"velocity at 200 Hz and 0 N, 300 Hz and 50 N, 600 Hz and 100 N, {most:.0f} V [mm/s]",
         "4.8, 30.5, 168.1", ", ".join(f"{max(v, 0.0):.1f}" for v in speeds),
         "they are other devices' entries in Table 5, and rise with load (errata M26)"),
        ("7.3", "A4's voltage at 100 and 300 V [V]", "800 at 100 V, 500 at 800 V",
         f"{a4[100.0]:.1f}, {a4[300.0]:.1f}", "Table 5's entries; our volts rest on an assumed gain (errata M15, M26)"),
        ("7.3", "velocity at 100 and 800 V [mm/s]", "30.5, 72.5",
         f"{weak:.1f} at 100 V", "Table 5's entries (errata M26)"),
        ("abstract", "optimal frequencies with their loads and flows", "0.01378 rad/s and others", "none",
         "rows of Table 2 that do not belong together (errata M25)"),
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=["section", "claim", "published", "ours", "why"])
