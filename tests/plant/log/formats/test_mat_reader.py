from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from hypothesis import given
from hypothesis import strategies as st

from plant.log.formats.mat_reader import MOST_NESTED, DamagedMatError, MatValue, read_variables

RNG = np.random.default_rng(3)
CONTENT: dict[str, Any] = {
    "wave": np.sin(np.arange(50.0)),
    "grid": np.arange(6.0).reshape(2, 3),
    "scalar": 2.5,
    "empty": np.zeros((0, 0)),
    "note": "µ → β",
    "phasor": np.array([1.0 + 2.0j, 3.0]),
    "bench": {"speed": RNG.standard_normal(20), "deep": {"name": "x", "k": 3}},
    **{f"as_{kind}": np.arange(7).astype(kind) for kind in ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4")},
}


def written(content: Mapping[str, Any], *, compress: bool) -> bytes:
    file = BytesIO()
    scipy.io.savemat(file, dict(content), do_compression=compress)
    return file.getvalue()


def agrees(mine: MatValue, theirs: Any) -> bool:
    if mine is None:
        return True
    if isinstance(mine, Mapping):
        return all(agrees(value, theirs[name]) for name, value in mine.items())
    if isinstance(mine, str):
        return mine == theirs
    if isinstance(mine, list):
        return all(agrees(one, other) for one, other in zip(mine, np.ravel(theirs), strict=True))
    theirs = np.asarray(theirs)
    return mine.size == theirs.size == 0 or bool(np.array_equal(mine, theirs))


@pytest.mark.parametrize("compress", [False, True])
def test_every_kind_of_variable_comes_back_as_scipy_wrote_it(compress: bool) -> None:
    variables = read_variables(written(CONTENT, compress=compress))
    assert list(variables) == list(CONTENT)
    for name, value in CONTENT.items():
        assert variables[name] is not None
        assert agrees(variables[name], value), name


def test_cell_arrays_are_skipped_and_struct_arrays_become_lists() -> None:
    structs = np.zeros(3, dtype=[("a", float)])
    content = {"cells": np.array(["a", 1], dtype=object), "structs": structs, "wave": np.arange(3.0)}
    variables = read_variables(written(content, compress=False))
    assert variables.get("cells") is None
    assert variables.get("structs") == [{"a": np.array(0.0)}] * 3
    np.testing.assert_array_equal(np.asarray(variables["wave"]), np.arange(3.0))


def test_files_that_matlab_wrote_are_read_as_scipy_reads_them() -> None:
    folder = Path(scipy.io.__file__).parent / "matlab" / "tests" / "data"
    files = sorted(folder.glob("test[dmscou]*_[67]*.mat"))
    if not files:
        pytest.skip("this scipy was installed without its sample files")
    compared = 0
    for file in files:
        if "hdf5" in file.name or "stringarray" in file.name:  # a block of text contains no column
            continue
        variables = read_variables(file.read_bytes())
        theirs: dict[str, Any] = scipy.io.loadmat(file, simplify_cells=True)
        for name, value in variables.items():
            assert agrees(value, theirs[name]), (file.name, name)
            compared += value is not None
    assert compared > 20


WHOLE = {compress: written({"wave": np.arange(9.0), "s": {"a": 1.0}}, compress=compress) for compress in (False, True)}


def variables_or_damage(content: bytes) -> None:
    try:
        assert isinstance(read_variables(content), dict)
    except DamagedMatError as error:
        assert str(error)  # noqa: PT017 (a result is as good as a refusal)


@pytest.mark.parametrize("value", [0, 1, 14, 255])
def test_no_single_wrong_byte_can_crash_the_reader(value: int) -> None:
    for compress in (False, True):
        for at in range(124, len(WHOLE[compress])):
            damaged = bytearray(WHOLE[compress])
            damaged[at] = value
            variables_or_damage(bytes(damaged))


def test_a_file_cut_at_any_byte_is_read_or_refused_as_damaged() -> None:
    for stop in range(len(WHOLE[False])):
        variables_or_damage(WHOLE[False][:stop])


@given(tail=st.binary(max_size=200))
def test_random_bytes_after_the_header_cannot_crash_the_reader(tail: bytes) -> None:
    variables_or_damage(WHOLE[False][:128] + tail)


def test_nested_structs_are_read_up_to_the_depth_limit_and_refused_beyond() -> None:
    def nested(depth: int) -> dict[str, Any]:
        content: Any = np.arange(3.0)
        for _ in range(depth):
            content = {"inner": content}
        return {"outer": content}

    found: Any = read_variables(written(nested(MOST_NESTED), compress=False))["outer"]
    for _ in range(MOST_NESTED):
        found = found["inner"]
    assert np.array_equal(found, np.arange(3.0))
    with pytest.raises(DamagedMatError, match=f"over {MOST_NESTED} deep"):
        read_variables(written(nested(2 * MOST_NESTED), compress=False))
