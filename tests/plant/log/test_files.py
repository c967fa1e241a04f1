import gzip
import json
import string
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from plant.errors import ClockError, LogError, LogWarning
from plant.log.columns import CHANNELS
from plant.log.files import read_record, sidecar, write_record
from plant.log.notes import LogCode
from plant.log.record import Record

FORMATS = ("run.csv", "run.txt", "run.csv.gz", "run.parquet", "run.mat")
N = 200
TIME = 1e-3 * np.arange(N)
SPEED = 100.0 * np.sin(20.0 * TIME)
VELOCITY = 0.03 * np.sin(20.0 * TIME)


def example(**channels: np.ndarray) -> Record:
    metadata = {"plant": "lumped", "seed": 3, "parameters": {"piston_area": 1.52e-3}, "fault": None, "note": "µ → β"}
    return Record(1e-3, {"motor_speed_rad_s": SPEED, "velocity_m_s": VELOCITY, **channels}, metadata, 0.25)


def assert_same(back: Record, record: Record) -> None:
    assert back.sample_time == record.sample_time
    assert back.start_time == record.start_time
    assert dict(back.metadata) == dict(record.metadata)
    assert sorted(back) == sorted(record)
    for name in record:
        np.testing.assert_array_equal(back[name], record[name])


@pytest.mark.parametrize("name", FORMATS)
def test_a_record_comes_back_whole_from_every_format(tmp_path: Path, name: str) -> None:
    record = example(true_bulk_modulus_pa=np.full(N, 2.07e8), motor_voltage_v=3.0 * np.cos(TIME))
    write_record(record, tmp_path / name)
    assert_same(read_record(tmp_path / name), record)


@pytest.mark.parametrize("name", FORMATS)
def test_missing_samples_come_back_missing(tmp_path: Path, name: str) -> None:
    velocity = VELOCITY.copy()
    velocity[[0, 50, N - 1]] = np.nan
    truth = np.full(N, np.nan)
    write_record(example(velocity_m_s=velocity, true_state=truth), tmp_path / name)
    with pytest.warns(LogWarning) as caught:
        back = read_record(tmp_path / name)
    masked = LogCode.SAMPLES_MASKED.note(channel="velocity_m_s", count=3, total=200, percent=1.5)
    assert [one.message.note for one in caught] == [masked]
    assert_same(back, example(velocity_m_s=velocity, true_state=truth))


names = st.sampled_from(sorted(CHANNELS)) | st.text(string.ascii_lowercase + "_", min_size=1, max_size=20).map(
    "true_".__add__
)
finite = st.floats(allow_nan=False, allow_infinity=False)
plain = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | finite | st.text(max_size=10),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


@st.composite
def records(draw: st.DrawFn) -> Record:
    count = draw(st.integers(10, 40))
    chosen = draw(st.lists(names, min_size=1, max_size=4, unique=True))
    channels = {name: draw(arrays(np.float64, count, elements=finite)) for name in chosen}
    # a record with both port pressures would come back with their difference added
    if {"pressure_a_pa", "pressure_b_pa"} <= set(channels):
        channels.setdefault("differential_pressure_pa", np.zeros(count))
    return Record(
        draw(st.floats(1e-7, 1e3)),
        channels,
        draw(st.dictionaries(st.text(max_size=10), plain, max_size=3)),
        draw(st.floats(-1e9, 1e9)),
    )


@pytest.mark.parametrize("name", ["run.csv", "run.parquet", "run.mat"])
@settings(max_examples=15)
@given(record=records())
def test_any_finite_record_comes_back_from_every_format(
    tmp_path_factory: pytest.TempPathFactory, name: str, record: Record
) -> None:
    path = tmp_path_factory.mktemp("any") / name
    write_record(record, path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)  # arbitrary numbers are implausible
        assert_same(read_record(path, required=()), record)


def test_metadata_are_the_same_json_beside_a_csv_and_within_parquet_and_mat(tmp_path: Path) -> None:
    for name in ("run.csv", "run.parquet", "run.mat"):
        write_record(example(), tmp_path / name)
    beside = json.loads((tmp_path / "run.csv.json").read_text())
    inside = json.loads(pq.read_schema(tmp_path / "run.parquet").metadata[b"hydrostate"])
    struct = scipy.io.loadmat(tmp_path / "run.mat", simplify_cells=True)["record"]
    assert beside == inside == json.loads(struct["metadata_json"])
    assert beside["metadata"]["parameters"] == {"piston_area": 1.52e-3}


def test_a_csv_is_readable_by_pandas_and_a_mat_holds_plain_columns(tmp_path: Path) -> None:
    write_record(example(), tmp_path / "run.csv")
    frame = pd.read_csv(tmp_path / "run.csv")
    assert list(frame) == ["time_s", "motor_speed_rad_s", "velocity_m_s"]
    np.testing.assert_array_equal(frame["velocity_m_s"], VELOCITY)
    write_record(example(), tmp_path / "run.mat")
    assert scipy.io.loadmat(tmp_path / "run.mat")["record"]["velocity_m_s"][0, 0].shape == (N, 1)


def test_a_csv_edited_after_writing_keeps_its_metadata_and_its_own_clock(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    write_record(example(), path)
    frame = pd.read_csv(path)
    frame.assign(time_s=2.0 * frame["time_s"]).to_csv(path, index=False)
    back = read_record(path)
    assert back.sample_time == pytest.approx(2e-3, rel=1e-9)
    assert back.metadata["seed"] == 3


@pytest.mark.parametrize("text", ["{}", "[1, 2]", '{"file": "run.csv"}'])
def test_a_json_of_another_program_beside_a_csv_is_ignored(tmp_path: Path, text: str) -> None:
    path = tmp_path / "run.csv"
    write_record(example(), path)
    sidecar(path).write_text(text)
    assert dict(read_record(path).metadata) == {}


@pytest.mark.parametrize(
    ("text", "wanted"),
    [("{", "JSON"), ('{"hydrostate_record": 1, "metadata": 3}', "JSON object"), ("[" * 100_000, "JSON")],
)
def test_damaged_metadata_beside_a_csv_are_left_out_with_a_warning(tmp_path: Path, text: str, wanted: str) -> None:
    path = tmp_path / "run.csv"
    write_record(example(), path)
    sidecar(path).write_text(text)
    with pytest.warns(LogWarning) as caught:
        back = read_record(path)
    assert [one.message.note for one in caught] == [LogCode.METADATA_UNREADABLE.note(wanted=wanted)]
    np.testing.assert_array_equal(back["velocity_m_s"], VELOCITY)


def test_mat_with_plain_variables_is_read(tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    plain_variables = {"time_ms": 1e3 * TIME, "RPM": SPEED, "velocity_mm_s": 1e3 * VELOCITY, "note": "x", "k": 3}
    scipy.io.savemat(path, plain_variables)
    record = read_record(path, columns={"motor_speed_rad_s": "RPM"})
    np.testing.assert_allclose(record["velocity_m_s"], VELOCITY)
    assert record.sample_time == pytest.approx(1e-3)


def test_mat_with_integer_counts_and_a_struct_of_any_name_is_read(tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    speed = np.rint(SPEED).astype(np.int16)
    scipy.io.savemat(path, {"bench": {"time_s": TIME, "motor_speed_rpm": speed, "velocity_m_s": VELOCITY}})
    np.testing.assert_allclose(read_record(path)["motor_speed_rad_s"], speed * np.pi / 30.0)


def test_parquet_of_integers_and_single_precision_is_read(tmp_path: Path) -> None:
    path = tmp_path / "run.parquet"
    columns = {"time_ms": np.arange(N), "motor_speed_rad_s": SPEED, "velocity_m_s": VELOCITY.astype(np.float32)}
    pq.write_table(pa.table(columns), path)
    record = read_record(path)
    assert record.sample_time == pytest.approx(1e-3)
    np.testing.assert_allclose(record["velocity_m_s"], VELOCITY, rtol=1e-6)


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_separators_are_found_in_the_header(tmp_path: Path, separator: str) -> None:
    frame = pd.DataFrame({"time_s": TIME, "motor_speed_rad_s": SPEED, "velocity_m_s": VELOCITY})
    frame.to_csv(tmp_path / "run.csv", sep=separator, index=False)
    np.testing.assert_array_equal(read_record(tmp_path / "run.csv")["velocity_m_s"], VELOCITY)


def test_decimal_commas_between_semicolons_are_read(tmp_path: Path) -> None:
    frame = pd.DataFrame({"time_s": TIME, "motor_speed_rad_s": SPEED, "velocity_m_s": VELOCITY})
    frame.to_csv(tmp_path / "run.csv", sep=";", decimal=",", index=False)
    np.testing.assert_array_equal(read_record(tmp_path / "run.csv")["velocity_m_s"], VELOCITY)


def test_the_csv_of_an_unruly_logger_is_read(tmp_path: Path) -> None:
    rows = [f" {t:.3f} ,{w:+.6f},run 1,{v:.9f}" for t, w, v in zip(TIME, SPEED, VELOCITY, strict=True)]
    rows[7] = rows[7].rsplit(",", 1)[0] + ", None "
    text = '\ufeff\r\n"time_s" , motor_speed_rad_s,"note, free",velocity_m_s\r\n' + "\r\n".join(rows) + "\r\n\r\n"
    (tmp_path / "run.CSV").write_bytes(text.encode())
    with pytest.warns(LogWarning) as caught:
        record = read_record(tmp_path / "run.CSV")
    masked = LogCode.SAMPLES_MASKED.note(channel="velocity_m_s", count=1, total=200, percent=0.5)
    assert [one.message.note for one in caught] == [masked]
    np.testing.assert_allclose(record["motor_speed_rad_s"], SPEED, atol=1e-6)


def test_columns_of_simulated_truth_that_hold_text_are_left_out(tmp_path: Path) -> None:
    frame = pd.DataFrame({"time_s": TIME, "motor_speed_rad_s": SPEED, "velocity_m_s": VELOCITY})
    frame["true_class"], frame["true_x"] = "none", 1.0
    frame.to_csv(tmp_path / "run.csv", index=False)
    frame.to_parquet(tmp_path / "run.parquet")
    for name in ("run.csv", "run.parquet"):
        assert list(read_record(tmp_path / name)) == ["motor_speed_rad_s", "velocity_m_s", "true_x"]


def test_warnings_point_at_the_caller(tmp_path: Path) -> None:
    velocity = VELOCITY.copy()
    velocity[3] = np.nan
    write_record(example(velocity_m_s=velocity), tmp_path / "run.csv")
    with pytest.warns(LogWarning) as caught:
        read_record(tmp_path / "run.csv")
    assert [Path(warning.filename).name for warning in caught] == [Path(__file__).name]


@pytest.mark.parametrize("name", FORMATS)
def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / name
    write_record(example(), path)
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    for place in ("files.write_csv", "formats.parquet.write_parquet", "formats.mat.write_mat"):
        monkeypatch.setattr(f"plant.log.{place}", full)
    with pytest.raises(LogError, match=rf"{name}: cannot be written: No space left"):
        write_record(example(motor_voltage_v=SPEED), path)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


def test_what_cannot_be_written_is_refused_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"a log is written as \.csv.*got \.xlsx"):
        write_record(example(), tmp_path / "run.xlsx")
    with pytest.raises(LogError, match="cannot be written: No such file"):
        write_record(example(), tmp_path / "nowhere" / "run.csv")
    with pytest.raises(LogError, match="metadata must be JSON values"):
        write_record(example().annotate(model=object()), tmp_path / "run.csv")
    with pytest.raises(LogError, match="metadata must be JSON values"):
        write_record(example().annotate(score=np.nan), tmp_path / "run.csv")
    with pytest.raises(LogError, match="MATLAB field name"):
        write_record(example(**{"true_" + 60 * "x": SPEED}), tmp_path / "run.mat")
    assert list(tmp_path.iterdir()) == []


def test_numpy_scalars_in_metadata_become_plain_numbers(tmp_path: Path) -> None:
    write_record(example().annotate(seed=np.int64(7), mean=np.arange(2)), tmp_path / "run.parquet")
    assert read_record(tmp_path / "run.parquet").metadata["seed"] == 7
    assert read_record(tmp_path / "run.parquet").metadata["mean"] == [0, 1]


def test_the_same_record_gives_the_same_compressed_bytes(tmp_path: Path) -> None:
    for name in ("a.csv.gz", "b.csv.gz"):
        write_record(example(), tmp_path / name)
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()
    assert gzip.decompress((tmp_path / "a.csv.gz").read_bytes()).startswith(b'"time_s"')


def test_every_bench_log_is_read_without_a_warning(shared: Path) -> None:
    logs = sorted((shared / "bench").glob("run*.csv"))
    assert len(logs) >= 18
    for log in logs:
        record = read_record(log)
        assert record.sample_time == pytest.approx(1e-3, rel=1e-9)
        assert list(record) == ["motor_speed_rad_s", "position_m", "velocity_m_s", "differential_pressure_pa"]


def test_a_log_with_foreign_names_is_read_through_a_mapping(shared: Path) -> None:
    columns = {"time_s": "t_s:s", "motor_voltage_v": "vir_V", "position_m": "position_qm_m:m"}
    with pytest.warns(LogWarning) as caught:
        record = read_record(shared / "data/emps/train.csv", columns=columns, required=("position_m",))
    assert LogCode.TIME_JITTERS in [one.message.note.code for one in caught]
    assert len(record) == 24841
    assert np.ptp(record["position_m"]) == pytest.approx(0.2464, abs=1e-4)


def test_stamps_of_whole_seconds_are_read_with_the_sample_time_option_of_the_refusal(tmp_path: Path) -> None:
    """The refusal named --sample-time, but the same refusal used to come again with it."""
    rows = (f"2026-11-29 10:00:0{k // 20},{k}.5,0.{k:03d}" for k in range(60))
    (tmp_path / "log.csv").write_text("\n".join(["time,motor_speed_rad_s,position_m", *rows]))
    with pytest.raises(ClockError, match="--sample-time S takes the rows as evenly spaced by S seconds"):
        read_record(tmp_path / "log.csv")
    with pytest.warns(
        LogWarning,
        match=r"not increase in 57 places, the first in row 2; all rows .* spaced by 0.05 s",
    ):
        record = read_record(tmp_path / "log.csv", sample_time=0.05)
    assert (record.sample_time, len(record)) == (0.05, 60)
    np.testing.assert_array_equal(record["motor_speed_rad_s"], np.arange(60) + 0.5)


@pytest.mark.parametrize("sample_time", [0.0, -1e-3, np.inf, np.nan])
def test_a_sample_time_that_is_not_positive_and_finite_is_refused(sample_time: float, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("motor_speed_rad_s,position_m\n" + "1.0,0.0\n" * 20)
    with pytest.raises(LogError, match="sample_time must be positive and finite"):
        read_record(tmp_path / "log.csv", sample_time=sample_time)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("log.csv", b"", "a header line is needed, but the file is empty"),
        ("log.csv", b"\xd0\xcf\x11\xe0" + bytes(600), "xls"),
        ("log.csv", bytes(512) + b"\x89HDF\r\n\x1a\n" + bytes(99), "log.csv"),
    ],
    ids=["empty", "old Excel", "HDF5 behind a block"],
)
def test_a_file_named_csv_with_other_content_is_refused_without_a_decoding_error(
    name: str, content: bytes, said: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LogError, match=said) as raised:
        read_record(tmp_path / name)
    assert "decode" not in str(raised.value)


def test_blanks_between_columns_are_read_and_a_short_row_is_refused(tmp_path: Path) -> None:
    rows = [f"{1e-3 * k:.3f}   {2 * k}  {k}" for k in range(20)]
    path = tmp_path / "blanks.txt"
    path.write_text("\n".join(["time_s   motor_speed_rpm  position_mm", *rows]) + "\n")
    record = read_record(path)
    np.testing.assert_allclose(record["position_m"], 1e-3 * np.arange(20))
    path.write_text("\n".join(["time_s   motor_speed_rpm  position_mm", *rows[:15], "0.015  3", *rows[16:]]) + "\n")
    with pytest.raises(LogError, match="row 16"):
        read_record(path)


def test_the_refusal_of_a_damaged_file_contains_no_memory_address(tmp_path: Path) -> None:
    np.save(tmp_path / "run.npy", np.zeros(20, [(one, float) for one in ("time_s", "motor_speed_rad_s", "position_m")]))
    content = (tmp_path / "run.npy").read_bytes().replace(b"'fortran_order': False", b"'fortran_order': Falke")
    (tmp_path / "run.npy").write_bytes(content)
    with pytest.raises(LogError) as caught:
        read_record(tmp_path / "run.npy")
    assert "malformed" in str(caught.value)
    assert "0x" not in str(caught.value)
