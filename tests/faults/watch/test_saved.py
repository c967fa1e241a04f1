from pathlib import Path

import numpy as np
import pytest

from faults.watch.events import Alarm
from faults.watch.saved import load_state, save_watch
from faults.watch.watch import Watch
from plant.eha.model import EhaParameters
from plant.errors import HydrostateError
from plant.kept import write_kept

P, T = EhaParameters(), 5e-3


def samples(seconds: float, leak_from: float) -> np.ndarray:
    rng = np.random.default_rng(0)
    count = round(seconds / T)
    speed = P.rated_speed * np.repeat(rng.choice((-1.0, 1.0), count // 10 + 1), 10)[:count]
    share = np.where(T * np.arange(count) < leak_from, 0.9, 0.6)
    velocity = share * P.pump_displacement * speed / P.piston_area
    pressure = 1e7 * velocity + 5e3 * rng.standard_normal(count)
    return np.column_stack([speed, np.cumsum(velocity) * T + 1e-6 * rng.standard_normal(count), pressure])


# within a block of the learning phase, and between an alarm and its change
@pytest.mark.parametrize("cut", [3_333, 18_100])
def test_a_watch_that_is_saved_and_resumed_gives_bit_identical_results(cut: int, tmp_path: Path) -> None:
    rows = samples(100.0, leak_from=90.0)
    whole, first = Watch(P, T, learning=60.0), Watch(P, T, learning=60.0)
    wanted, before = whole.take(rows), first.take(rows[:cut])
    save_watch(first, tmp_path / "state.npz", 0.25)
    values, sample_time, travelled = load_state(tmp_path / "state.npz")
    assert (sample_time, travelled) == (T, 0.25)
    second = Watch(P, T, learning=60.0)
    second.resume(values)
    assert before + second.take(rows[cut:]) == wanted
    assert any(isinstance(event, Alarm) for event in wanted)
    for name, one in whole.remembered().items():
        np.testing.assert_array_equal(one, second.remembered()[name])


def test_a_state_of_other_settings_and_an_invalid_state_file_are_refused(tmp_path: Path) -> None:
    kept = Watch(P, T, learning=60.0).remembered()
    with pytest.raises(HydrostateError, match="can only continue one of the same rig"):
        Watch(P, T, learning=90.0).resume(kept)
    with pytest.raises(HydrostateError, match="can only continue one of the same rig"):
        Watch(P, T, learning=60.0, pressure=False).resume(kept)
    wrong = tmp_path / "state.npz"
    wrong.write_text("no archive")
    with pytest.raises(HydrostateError, match="a state of hydrostate watch is needed"):
        load_state(wrong)
    np.savez(wrong, format=np.array("another"))
    with pytest.raises(
        HydrostateError, match="'another', which this version cannot continue; to begin again, delete it"
    ):
        load_state(wrong)


def test_a_state_of_the_format_before_pauses_were_counted_is_continued(tmp_path: Path) -> None:
    rows, path = samples(100.0, leak_from=90.0), tmp_path / "state.npz"
    whole, first = Watch(P, T, learning=60.0), Watch(P, T, learning=60.0)
    wanted, before = whole.take(rows), first.take(rows[:14_000])
    kept = first.remembered()
    kept["memory_1"], kept["asked"] = kept["memory_1"][:4], kept["asked"][:-1]
    write_kept(path, "hydrostate watch 3", {"sample_time": np.array(T), "travelled": np.array(0.0), **kept})
    second = Watch(P, T, learning=60.0)
    second.resume(load_state(path)[0])
    assert before + second.take(rows[14_000:]) == wanted
