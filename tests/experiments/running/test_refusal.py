from pathlib import Path

import pytest

from experiments.batch.part_store import open_store
from experiments.running.refusal import os_errors_as
from plant.errors import HydrostateError

SAID = "out is a file, and a folder is needed there: choose another name, or move the file$"


@pytest.mark.parametrize("below", ["", "b"])
def test_a_file_in_place_of_a_folder_is_named_with_the_remedy(tmp_path: Path, below: str) -> None:
    out = tmp_path / "out"
    out.write_text("x")
    with pytest.raises(HydrostateError, match=SAID), os_errors_as("--out: the folder cannot be made"):
        (out / below).mkdir(parents=True, exist_ok=True)
    with pytest.raises(HydrostateError, match=SAID):
        open_store(out / below).manifest()
