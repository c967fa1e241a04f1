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

from plant.atomic import replacing
from plant.compiled.kernel_folder import cache_folder, objection

logger = logging.getLogger("hydrostate")

_LOADING = threading.Lock()
"""Held while a kernel file is written and imported, so that threads share one module."""


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
    import numba

    digest = hashlib.sha256(f"{numba.__version__}\n{source}".encode()).hexdigest()[:16]
    module_name = f"hydrostate_{name}_{digest}"
    with _LOADING:
        return sys.modules.get(module_name) or _imported(module_name, source)


def _imported(module_name: str, source: str) -> ModuleType:
    from plant.compiled.numba_cache import check

    path = _written(module_name, source)
    if not any((path.parent / "__pycache__").glob(f"{module_name}.*.nbi")):  # Numba's index of what it has compiled
        logger.info("compiling the kernel %s", module_name)
    spec = importlib.util.spec_from_file_location(module_name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"the generated kernel {path} cannot be imported")
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    spec.loader.exec_module(module)
    check(module)
    return module


def _written(module_name: str, source: str) -> Path:
    """Return the kernel's file; where the cache folder cannot be written or trusted, one in a temporary folder."""
    folder = cache_folder()
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        reason = objection(folder.stat())
        if reason is None:
            return _whole(folder / f"{module_name}.py", source)
        logger.warning("compiled kernels in %s are not used, for %s: compiling for this run only", folder, reason)
    except OSError as error:
        logger.warning("kernels cannot be cached in %s (%s); compiling for this run only", folder, error.strerror)
    return _whole(Path(tempfile.mkdtemp(prefix="hydrostate-")) / f"{module_name}.py", source)


def _whole(path: Path, source: str) -> Path:
    """Write a file that is there whole or not at all, unless it is there as it should be."""
    try:
        with path.open("rb") as file:
            if objection(os.fstat(file.fileno())) is None and file.read() == source.encode():
                return path
    except OSError:
        pass
    with replacing(path) as file:
        if hasattr(os, "fchmod"):
            os.fchmod(file.fileno(), 0o600)
        file.write(source.encode())
    return path
