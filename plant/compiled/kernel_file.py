"""Keeps generated kernels as files, so that Numba's cache serves later processes.

A function compiled from a string cannot be cached, and Numba does not notice a change in a function that a cached
one calls. So a kernel file is self-contained and its name is a hash of its own text and of the Numba version.
"""

import hashlib
import importlib.util
import logging
import os
import sys
import tempfile
import threading
from pathlib import Path
from types import ModuleType

import numba
import platformdirs

logger = logging.getLogger("hydrostate")

_LOADING = threading.Lock()
"""Held while a kernel file is written and imported, so that threads share one module."""


def cache_folder() -> Path:
    """Return the folder of generated kernels: ``HYDROSTATE_CACHE``, or the user's cache directory."""
    chosen = os.environ.get("HYDROSTATE_CACHE")
    return Path(chosen) if chosen else Path(platformdirs.user_cache_dir("hydrostate"))


def load_kernel(name: str, source: str) -> ModuleType:
    """Write a kernel's source to the cache folder, unless it is there, and import it.

    Parameters
    ----------
    name : str
        What the kernel is, for the file's name.
    source : str
        Python source that imports all it needs.

    Returns
    -------
    ModuleType
        The imported file. Calling its functions compiles them, unless an earlier process did.
    """
    digest = hashlib.sha256(f"{numba.__version__}\n{source}".encode()).hexdigest()[:16]
    module_name = f"hydrostate_{name}_{digest}"
    with _LOADING:
        return sys.modules.get(module_name) or _imported(module_name, source)


def _imported(module_name: str, source: str) -> ModuleType:
    path = _written(module_name, source)
    if not any((path.parent / "__pycache__").glob(f"{module_name}.*.nbi")):  # Numba's index of what it has compiled
        logger.info("compiling the kernel %s", module_name)
    spec = importlib.util.spec_from_file_location(module_name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"the generated kernel {path} cannot be imported")
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    spec.loader.exec_module(module)
    return module


def _written(module_name: str, source: str) -> Path:
    """Return the kernel's file; where the cache folder cannot be written, one in a temporary folder."""
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{module_name}.py"
        return path if path.exists() else _whole(path, source)
    except OSError as error:
        logger.warning("kernels cannot be cached in %s (%s); compiling for this run only", folder, error.strerror)
        return _whole(Path(tempfile.mkdtemp(prefix="hydrostate-")) / f"{module_name}.py", source)


def _whole(path: Path, source: str) -> Path:
    """Write a file that is there whole or not at all."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(source)
    return Path(temporary).replace(path)
