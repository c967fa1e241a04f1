from pathlib import Path

import numpy as np
import pytest

import hydrostate as hs
from benchmarks.diagnosis.own_classes import read_rig_cycles, unknown_shares
from plant.errors import LogError


@pytest.fixture(scope="module")
def rig(shared: Path) -> Path:
    folder = shared / "data" / "uci_hydraulic"
    if not folder.is_dir():
        pytest.skip(f"no data of the ZeMA test rig in {folder}")
    return folder


def test_missing_or_mismatched_data_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"uci_hydraulic_1hz\.npz and profile\.csv are wanted"):
        read_rig_cycles(tmp_path)
    np.savez(tmp_path / "uci_hydraulic_1hz.npz", X=np.zeros((2, 3, 60)))
    (tmp_path / "profile.csv").write_text("pump_leak,valve_pct\n0,100\n")
    with pytest.raises(LogError, match="got 1 rows of pump_leak, valve_pct for 2 cycles"):
        read_rig_cycles(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(("component", "least"), [("pump_leak", 0.98), ("valve_pct", 0.99)])
def test_component_states_of_the_zema_rig_are_classified_in_contiguous_blocks(
    rig: Path, component: str, least: float
) -> None:
    pytest.importorskip("sklearn", reason="scikit-learn is not installed (extra learn)")
    cycles, labels = read_rig_cycles(rig)
    features = hs.features(cycles)
    verdicts = hs.Classifier().judge(features, labels[component])
    assert verdicts.balanced_accuracy >= least
    assert verdicts.calibration_error < 0.02
    assert np.mean(verdicts.likeness <= 0.01) <= 0.01
    assert min(unknown_shares(features, labels[component]).values()) > 0.9
