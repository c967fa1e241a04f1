"""One log, written in 27 ways by the real libraries, gives one Record, read unaided or as `inspect` advises."""

import json
import shutil
import warnings
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import hydrostate as hs
from experiments.cli import app
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import LogError, LogWarning
from plant.log.files import read_record
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.log_formats.more_written import MORE
from tests.log_formats.written import SI, WAYS, T, Way, rounded, with_a_copied_row

READ = {name: way for name, way in WAYS.items() if not way.refused}
REFUSED = {name: way for name, way in WAYS.items() if way.refused}
ALSO_READ = {name: way for name, way in MORE.items() if not way.refused}
ALSO_REFUSED = {name: way for name, way in MORE.items() if way.refused}


@pytest.fixture(scope="module")
def log() -> pd.DataFrame:
    healthy, rng = EhaParameters(), np.random.default_rng(5)
    drive = make_drive("prbs", 2.0, T, healthy, rng)
    record = simulate(LUMPED, drive, T, healthy, sensors=BENCH, rng=rng)
    return record.slice(0, 2000).to_frame()[list(SI)]


@pytest.fixture(scope="module")
def written(log: pd.DataFrame, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Return a function from the name of a way to a file written in it; each is written once."""
    return cache(lambda name: READ[name].write(log, tmp_path_factory.mktemp("way")))


def options_of(way: Way, path: Path) -> dict[str, Any]:
    options = dict(way.options)
    if "beside" in options:
        options["beside"] = [path.parent / name for name in options["beside"]]
    if way.inspected:
        options["columns"] = inspected(path)["columns"]
    return options


def inspected(path: Path) -> Mapping[str, Any]:
    done = CliRunner().invoke(app, ["inspect", str(path), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)[0]


def assert_same(record: Record, log: pd.DataFrame) -> None:
    assert record.sample_time == pytest.approx(T, rel=1e-6)
    assert len(record) == len(log)
    for name in SI[1:]:
        size = float(np.abs(log[name]).max())
        np.testing.assert_allclose(record[name], log[name], rtol=0.0, atol=1e-6 * size, err_msg=name)


def test_25_of_27_ways_to_write_a_log_are_read_and_2_are_refused() -> None:
    assert (len(READ), len(REFUSED)) == (25, 2)


@pytest.mark.parametrize("name", READ)
def test_a_log_gives_the_same_record_in_every_format(
    name: str, log: pd.DataFrame, written: Callable[[str], Path]
) -> None:
    path = written(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        assert_same(read_record(path, **options_of(READ[name], path)), log)


@pytest.mark.parametrize("name", [name for name, way in READ.items() if "beside" not in way.options])
def test_a_log_is_read_whatever_its_name_as_a_server_keeps_it(
    name: str, log: pd.DataFrame, written: Callable[[str], Path], tmp_path: Path
) -> None:
    path = written(name)
    kept = Path(shutil.copy(path, tmp_path / "0123456789abcdef"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        assert_same(read_record(kept, **options_of(READ[name], path)), log)


@pytest.mark.parametrize("name", ALSO_READ)
def test_a_log_gives_the_same_record_in_the_formats_of_instruments_and_scripts(
    name: str, log: pd.DataFrame, tmp_path: Path
) -> None:
    path = ALSO_READ[name].write(log, tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        assert_same(read_record(path, **options_of(ALSO_READ[name], path)), log)


@pytest.mark.parametrize("name", READ)
def test_inspect_finds_every_channel_in_every_format(name: str, written: Callable[[str], Path]) -> None:
    found = inspected(written(name))
    wanted = set(SI) - ({"differential_pressure_pa"} if name == "two loggers" else set())
    wanted -= {"time_s"} if name in ("no time", "TDMS with a step") else set()
    assert wanted <= found["columns"].keys()
    assert found["reads"] or "--sample-time" in found["message"]


@pytest.mark.parametrize("way", [*REFUSED.values(), *ALSO_REFUSED.values()], ids=[*REFUSED, *ALSO_REFUSED])
def test_what_cannot_be_read_is_refused_with_the_remedy(way: Way, log: pd.DataFrame, tmp_path: Path) -> None:
    with pytest.raises(LogError, match=way.refused):
        read_record(way.write(log, tmp_path))


@pytest.mark.parametrize("write", [rounded, with_a_copied_row])
def test_rounded_stamps_and_duplicate_rows_are_corrected_with_a_note(
    write: Any, log: pd.DataFrame, tmp_path: Path
) -> None:
    with pytest.warns(LogWarning) as caught:
        record = read_record(write(log, tmp_path))
    assert [one.message.note.code for one in caught] in (["time_rounded"], ["time_repeats"])
    assert_same(record, log)


@pytest.mark.slow
@pytest.mark.parametrize("name", READ)
def test_a_log_gives_the_same_estimate_in_every_format(
    name: str, log: pd.DataFrame, written: Callable[[str], Path]
) -> None:
    path = written(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        found = hs.read(path, **options_of(READ[name], path)).estimate()
    wanted = hs.Log(Record(T, {name: log[name].to_numpy() for name in SI[1:]}), hs.Rig()).estimate()
    assert found.bulk_modulus.value == pytest.approx(wanted.bulk_modulus.value, rel=1e-6)
