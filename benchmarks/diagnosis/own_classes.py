"""The hydraulic test rig of ZeMA, whose faults are not those of Table 1, scored with the user-defined classes."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

import hydrostate as hs
from plant.arrays import Array
from plant.errors import LogError

if TYPE_CHECKING:
    from faults.own_classes.verdicts import Verdicts


BLOCKS = 10
"""Contiguous blocks of runs; each is scored by a classifier trained on the others."""

COMPONENTS = ("pump_leak", "valve_pct", "cooler_pct", "accumulator_bar")
"""Label columns: internal leakage of the pump (0 none, 1 weak, 2 severe), how far the valve switches [%], the cooler's
efficiency [%], and the accumulator's pressure [bar]."""

MOST_FALSE_UNKNOWN = 0.01
"""Allowed share of runs of known classes that are called unknown [fraction]."""


def read_rig_cycles(folder: Path) -> tuple[Array, pd.DataFrame]:
    """Read the ZeMA test rig's cycles at one sample a second (UCI data set 447, CC BY 4.0).

    Parameters
    ----------
    folder : Path
        Folder with ``uci_hydraulic_1hz.npz`` (entry ``X``) and ``profile.csv`` (one row of labels for each cycle).

    Returns
    -------
    cycles : ndarray, shape (2205, 17, 60)
        Pressures [bar], power [W], flows [l/min], temperatures [degC], and derived quantities.
    labels : pandas.DataFrame
        With the columns `COMPONENTS`.

    Raises
    ------
    LogError
        If a file is missing, or they do not belong together.
    """
    try:
        with np.load(folder / "uci_hydraulic_1hz.npz") as held:
            cycles = held["X"].astype(np.float64)
        labels = pd.read_csv(folder / "profile.csv")
    except (OSError, KeyError, ValueError) as error:
        raise LogError(f"{folder}: uci_hydraulic_1hz.npz and profile.csv are wanted: {error}") from error
    lacking = [name for name in COMPONENTS if name not in labels]
    if lacking or len(labels) != len(cycles):
        raise LogError(
            f"{folder}: one row of {', '.join(COMPONENTS)} a cycle is wanted, got {len(labels)} rows of "
            f"{', '.join(map(str, labels.columns))} for {len(cycles)} cycles"
        )
    return cycles, labels


def rig_verdicts(features: pd.DataFrame, labels: pd.DataFrame) -> "Mapping[str, Verdicts]":
    """Score every component of the ZeMA test rig in contiguous blocks.

    Parameters
    ----------
    features : pandas.DataFrame
        One row for each cycle.
    labels : pandas.DataFrame
        See `read_rig_cycles`.
    """
    return {name: hs.Classifier().judge(features, labels[name], blocks=BLOCKS) for name in COMPONENTS}


def unknown_shares(features: pd.DataFrame, labels: pd.Series) -> dict[str, float]:
    """Return the share of each class that is called unknown by a classifier trained on only the other classes.

    Parameters
    ----------
    features : pandas.DataFrame
        One row for each cycle.
    labels : pandas.Series
        Class of each cycle.

    Returns
    -------
    dict of str to float
        Share for each left-out class [fraction].
    """
    shares: dict[str, float] = {}
    for left_out in np.unique(labels):
        strange = (labels == left_out).to_numpy()
        learnt = hs.Classifier(unknown=MOST_FALSE_UNKNOWN).fit(features[~strange], labels[~strange])
        shares[str(left_out)] = float(np.mean(learnt.predict(features[strange]) == "unknown"))
    return shares
