"""Public input/output sets with the splits of their authors, or of the set's README if the authors give none."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from estimation.arrays import Array

DATA = Path(os.environ.get("HYDROSTATE_SHARED", "../shared")) / "data"
"""Folder of the sets; they are read there and never copied."""

Part = tuple[Array, Array]
"""Inputs, shape (n, m), and one output, shape (n,)."""


@dataclass(frozen=True)
class PublicSet:
    """One output of a public set.

    Parameters
    ----------
    name : str
        Name in the table.
    nonlinear : bool
        Whether its authors made it to be nonlinear.
    sample_time : float
        Seconds between samples [s].
    train : tuple
        Inputs and output for fitting.
    tests : mapping
        Inputs and output of each test, by name.
    skipped : int
        Samples at the start of a test that are excluded.
    again : mapping
        Other records of the same plant, each like the test, by name.
    """

    name: str
    nonlinear: bool
    sample_time: float
    train: Part
    tests: dict[str, Part]
    skipped: int = 0
    again: dict[str, Part] = field(default_factory=dict[str, Part])

    @property
    def parts(self) -> dict[str, Part]:
        """Tests and other records."""
        return {**self.tests, **self.again}


def public_sets(wanted: Sequence[str] = ()) -> list[PublicSet]:
    """Return the available sets.

    Parameters
    ----------
    wanted : sequence of str
        Parts of names; all sets if not given.
    """
    found = [one for make in (_tanks, _bouc_wen, _emps, _daisy) for one in _sets_if_present(make)]
    return [one for one in found if not wanted or any(part in one.name for part in wanted)]


def _sets_if_present(make: Callable[[], list[PublicSet]]) -> list[PublicSet]:
    try:
        return make()
    except FileNotFoundError:
        return []


def _table(path: str) -> dict[str, Array]:
    import pandas as pd

    frame = pd.read_csv(DATA / path)
    return {str(name): frame[name].to_numpy(dtype=np.float64) for name in frame.columns}


def _tanks() -> list[PublicSet]:
    table = _table("cascaded_tanks/cascaded_tanks.csv")
    train, test = ((table[f"u{part}"][:, None], table[f"y{part}"]) for part in ("Est", "Val"))
    return [PublicSet("cascaded tanks", True, 4.0, train, {"": test}, 5)]


def _bouc_wen() -> list[PublicSet]:
    parts = [_table(f"bouc_wen/{name}.csv") for name in ("train_multisine", "test_multisine", "test_sinesweep")]
    train, multisine, sweep = ((one["u_N"][:, None], one["y_m"]) for one in parts)
    return [PublicSet("Bouc-Wen", True, 1.0 / 750.0, train, {"multisine": multisine, "sweep": sweep}, 50)]


def _emps() -> list[PublicSet]:
    parts = [_table(f"emps/{name}.csv") for name in ("train", "test_pulses")]
    position = [(one["vir_V"][:, None], one["position_qm_m"]) for one in parts]
    speed = [(u, np.gradient(q, 1e-3)) for u, q in position]
    return [
        PublicSet("EMPS position", True, 1e-3, position[0], {"": position[1]}, 50),
        PublicSet("EMPS velocity", True, 1e-3, speed[0], {"": speed[1]}, 50),
    ]


DAISY: Sequence[tuple[str, tuple[str, ...], tuple[str, ...], float]] = (
    ("robot_arm", ("u_reaction_torque",), ("y_acceleration",), 2e-3),
    ("flutter", ("u",), ("y",), 1.0),
    ("dryer", ("u_heater",), ("y_temperature",), 0.08),
    ("ballbeam", ("u_beam_angle",), ("y_ball_position",), 0.1),
    ("heating_system", ("u_V",), ("y_temperature",), 2.0),
    ("exchanger", ("q_flow",), ("th_temperature",), 1.0),
    ("winding", ("u1", "u2", "u3", "u4", "u5"), ("y1", "y2"), 0.1),
    ("CD_player_arm", ("u1", "u2"), ("y1", "y2"), 1.0),
    (
        "steamgen",
        ("u1_fuel", "u2_air", "u3_ref_level", "u4_disturbance"),
        ("y1_drum_pressure", "y2_excess_O2", "y3_water_level", "y4_steam_flow"),
        3.0,
    ),
)
"""File, inputs, outputs, sample time [s]. The authors give no split: the first half is fitted, the second tested."""


def _daisy() -> list[PublicSet]:
    sets: list[PublicSet] = []
    for name, inputs, outputs, sample_time in DAISY:
        table = _table(f"daisy/{name}.csv")
        u = np.column_stack([table[one] for one in inputs])
        half = u.shape[0] // 2
        for output in outputs:
            title = f"{name} {output}" if len(outputs) > 1 else name
            y = table[output]
            sets.append(PublicSet(title, False, sample_time, (u[:half], y[:half]), {"": (u[half:], y[half:])}, 5))
    return sets
