"""The numbers that the piezo-stack paper's text quotes beside ours: all that is left of its figures (errata P17)."""

from collections.abc import Mapping

import pandas as pd

from experiments.piezo_stack.flow import HIGH_BIAS, LOW_BIAS, LOW_VOLTAGE, figure_points
from plant.units import LITRE_PER_MINUTE


def quoted_numbers(tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return the numbers that the paper's text quotes beside those of the figures' tables.

    Parameters
    ----------
    tables : Mapping[str, pandas.DataFrame]
        The tables of `figure_points`, and of `loop_widths` as ``figure 10 loop widths``.

    Returns
    -------
    pandas.DataFrame
        Columns figure, claim, published, ours, unit, holds.
    """
    bias, voltage, fixed, loads = (tables[name] for name in figure_points())
    high = bias[bias["bias_pressure_pa"] == HIGH_BIAS].set_index("frequency_hz")["flow_m3_s"] / LITRE_PER_MINUTE
    low = bias[bias["bias_pressure_pa"] == LOW_BIAS].set_index("frequency_hz")["flow_m3_s"] / LITRE_PER_MINUTE
    weak = voltage[voltage["voltage_v"] == LOW_VOLTAGE].set_index("frequency_hz")["flow_m3_s"] / LITRE_PER_MINUTE
    heavy = fixed[fixed["load_kg"] == 20.0].set_index("frequency_hz")["flow_m3_s"] / LITRE_PER_MINUTE
    near = heavy.loc[225.0:325.0]
    falling = {
        f: rows.set_index("load_kg")["flow_m3_s"] / LITRE_PER_MINUTE for f, rows in loads.groupby("frequency_hz")
    }
    rises = max(float(flow.diff().max() / flow.iloc[0]) for flow in falling.values())
    fifty = max(float(flow.loc[50.0]) for flow in falling.values())
    widths = tables["figure 10 loop widths"]["width_percent"]
    rows = [
        ("10", "loops widen with frequency up to 400 Hz", "model tracks", widths.iloc[-1], "% of stroke at 400 Hz",
         bool(widths.is_monotonic_increasing)),
        ("11", "no-load maximum, 140 V, 1.0 MPa", "close to 1.6", high.max(), "L/min", abs(high.max() - 1.6) <= 0.08),
        ("11", "its frequency", "275", high.idxmax(), "Hz", high.loc[250.0:300.0].max() == high.max()),
        ("11", "flow at 0.6 MPa and 275 Hz over that at 1.0 MPa", "below 1", low[275.0] / high[275.0], "1",
         low[275.0] < 0.85 * high[275.0]),
        ("11", "frequency of the maximum at 0.6 MPa", "275", low.idxmax(), "Hz",
         low.loc[250.0:300.0].max() == low.max()),
        ("11", "frequencies at which 0.6 MPa gives more than 1.0 MPa", "none", int((low > high).sum()), "count",
         not (low > high).any()),
        ("12", "flow at 100 V and 275 Hz over that at 140 V", "below 1", weak[275.0] / high[275.0], "1",
         weak[275.0] < 0.85 * high[275.0]),
        ("12", "frequency of the maximum at 100 V", "275", weak.idxmax(), "Hz",
         weak.loc[250.0:300.0].max() == weak.max()),
        ("13", "flow with 20 kg near the best frequency", "nearly 1.0", near.max(), "L/min",
         abs(near.max() - 1.0) <= 0.08),
        ("14", "largest rise of flow from one load to the next", "drops steadily", 100.0 * max(rises, 0.0),
         "% of no load", rises <= 0.0),
        ("14", "largest flow at 50 kg", "far more than 20 kg", fifty, "L/min", fifty > 0.0),
    ]  # fmt: skip
    columns = ("figure", "claim", "published", "ours", "unit", "holds")
    frame = pd.DataFrame(rows, columns=list(columns))
    return frame.astype({"ours": float, "holds": bool})
