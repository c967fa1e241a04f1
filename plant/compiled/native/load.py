"""Compiles a kernel's text, or loads the result of an earlier run."""

import hashlib
import logging
import threading
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from plant.compiled.native import machine, store
from plant.compiled.native.entry import Entry
from plant.compiled.native.kinds import SCALARS, AnyKind, ArrayKind, KernelError, TupleKind
from plant.compiled.native.recipes import recipe
from plant.compiled.native.signature import Signature, kind_as_json

logger = logging.getLogger("hydrostate")

_LOADING_LOCK = threading.Lock()
_LOADED: dict[str, "NativeKernel"] = {}


class NativeKernel(SimpleNamespace):
    """A compiled kernel: its entries as functions, and the constants of its text."""

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"the kernel has no {name!r}")


def load_native(
    name: str, text: str | Callable[[], str], entries: Mapping[str, Signature], made_of: object = None
) -> NativeKernel:
    """Compile a kernel's text to machine code, unless an earlier run has done so, and load it.

    Parameters
    ----------
    name : str
        Name of the kernel, for its file's name.
    text : str or callable
        Its source: functions, constants, and operations made of lines; or a function that writes it, called only if
        needed.
    entries : Mapping[str, Signature]
        The functions that Python calls, and the signature of each.
    made_of : object, optional
        Everything from which the text is written, see `plant.compiled.native.recipes.recipe`.

    Returns
    -------
    NativeKernel
        The functions by name; a call does not hold Python's lock.

    Raises
    ------
    KernelError
        If the text has unsupported code.

    Examples
    --------
    >>> import numpy as np
    >>> from plant.compiled.native.signature import signature
    >>> text = '''
    ... def total(values):
    ...     result = 0.0
    ...     for value in values:
    ...         result += value
    ...     return result
    ... '''
    >>> load_native("total", text, {"total": signature("values : ndarray, shape (n,)")}).total(np.arange(4.0))
    6.0
    """
    takes = repr(sorted(entries.items()))
    how = recipe(name, made_of, f"{_compiler()} {machine.target()} {takes}")
    remembered = store.load_kernel(f"{name}_recipe", how) if how is not None else None
    with _LOADING_LOCK:
        if remembered is not None:
            key = remembered[0]["kernel"]
            found = _LOADED.get(key) or _load_stored(name, entries, key)
            if found is not None:
                return _LOADED.setdefault(key, found)
        written = text if isinstance(text, str) else text()
        key = _key(written, takes)
        if key not in _LOADED:
            _LOADED[key] = _load_stored(name, entries, key) or _compile_and_store(name, written, entries, key)
        if how is not None:
            store.store_kernel(f"{name}_recipe", how, {"kernel": key}, b"")
        return _LOADED[key]


def _key(text: str, takes: str) -> str:
    """Return a hash of everything that determines the machine code."""
    digest = hashlib.sha256()
    for part in (_compiler(), machine.target(), text, takes):
        digest.update(f"{len(part)}\n{part}".encode())
    return digest.hexdigest()


@cache
def _compiler() -> str:
    """Return a hash of the compiler itself."""
    files = sorted(Path(__file__).parent.glob("*.py"))
    return hashlib.sha256(b"\n".join(file.read_bytes() for file in files)).hexdigest()


def _load_stored(name: str, entries: Mapping[str, Signature], key: str) -> NativeKernel | None:
    """Return a kernel that an earlier run has compiled."""
    found = store.load_kernel(name, key)
    return None if found is None else _link(name, entries, key, *found)


def _compile_and_store(name: str, text: str, entries: Mapping[str, Signature], key: str) -> NativeKernel:
    """Compile a kernel and keep it."""
    logger.info("compiling the kernel %s", name)
    description, code = _compile(name, text, entries)
    store.store_kernel(name, key, description, code)
    return _link(name, entries, key, description, code)


def _link(
    name: str, entries: Mapping[str, Signature], key: str, description: Mapping[str, Any], code: bytes
) -> NativeKernel:
    addresses = machine.load_and_link(f"{name}.{key[:16]}", code, [*entries, "release"])
    release = machine.as_callable(addresses["release"])
    kernel = NativeKernel(**description["constants"])
    for entry, takes in entries.items():
        one = description["entries"][entry]
        written, call = frozenset(one["written"]), machine.as_callable(addresses[entry])
        setattr(kernel, entry, Entry(f"{name}.{entry}", takes, _kind(one["returns"]), written, call, release))
    return kernel


def _compile(name: str, text: str, entries: Mapping[str, Signature]) -> tuple[dict[str, Any], bytes]:
    """Return description and machine code of a kernel."""
    from plant.compiled.native.program import Module

    module = Module(text)
    described: dict[str, Any] = {}
    try:
        for entry, takes in entries.items():
            compiled = module.enter(entry, tuple(argument.kind for argument in takes))
            described[entry] = {"returns": kind_as_json(compiled.returns), "written": sorted(compiled.written)}
    except KernelError as error:
        raise KernelError(f"kernel {name}: {error}") from None
    constants = {key: value for key, value in module.plain.items() if isinstance(value, int | float | dict)}
    return {"entries": described, "constants": constants}, machine.assemble(module.ir())


def _kind(text: Any) -> AnyKind:
    """Return a kind from its JSON form."""
    match text:
        case str():
            return SCALARS[text]
        case [element, rank]:
            return ArrayKind(SCALARS[element], rank)
        case _:
            return TupleKind(tuple(_kind(item) for item in text["items"]))
