"""What every test stands on: raising floating point, a hypothesis profile, a kernel cache, shared data."""

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings
from threadpoolctl import threadpool_limits

ROOT = Path(__file__).resolve().parents[1]

# Set before the first import that reads them. The folder is fixed, so that compiled kernels outlive a run.
os.environ["MPLBACKEND"] = "Agg"
os.environ.setdefault("HYDROSTATE_CACHE", str(ROOT / ".pytest_cache" / "hydrostate-kernels"))

settings.register_profile("ci", derandomize=True, deadline=None, max_examples=50, print_blob=False)
settings.load_profile("ci")


@pytest.fixture(scope="session", autouse=True)
def _one_thread_for_linear_algebra() -> Iterator[None]:
    """Small matrices on busy cores: the library's own threads only get in each other's way."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield


@pytest.fixture(autouse=True)
def _raising_floating_point() -> Iterator[None]:
    with np.errstate(divide="raise", invalid="raise", over="raise", under="ignore"):
        yield


@pytest.fixture(scope="session")
def shared() -> Path:
    """Return the folder of shared read-only data (bench logs), or skip where there is none."""
    folder = Path(os.environ.get("HYDROSTATE_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip(f"no shared data in {folder}: set HYDROSTATE_SHARED to the folder that holds bench/")
    return folder
