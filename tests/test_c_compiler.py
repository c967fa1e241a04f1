"""Programs compiled by tests are kept from run to run, as long as a test uses them."""

import os
from pathlib import Path

import pytest

from tests import c_compiler
from tests.c_compiler import UNUSED, compiled, ran


def test_a_program_is_compiled_once_and_deleted_after_a_month_without_use(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(c_compiler, "PROGRAMS", tmp_path / "programs")
    made = [_printing(tmp_path, word) for word in ("asked", "not asked")]
    for one in made:
        os.utime(one, (one.stat().st_atime, one.stat().st_mtime - UNUSED - 60))
    assert _printing(tmp_path, "asked") == made[0]
    third = _printing(tmp_path, "new")
    assert sorted((tmp_path / "programs").iterdir()) == sorted([made[0], third])
    assert ran(third, [])[0] == "new\n"


def _printing(folder: Path, word: str) -> Path:
    text = f'#include <stdio.h>\nint main(void) {{ puts("{word}"); return 0; }}\n'
    return compiled(folder, {"main.c": text})
