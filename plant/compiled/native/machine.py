"""LLVM: from its intermediate representation to machine code, and then to addresses that can be called."""

import ctypes
import threading
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

OPTIMISATION_LEVEL = 1
"""LLVM's optimisation level: at 0 a kernel runs half as fast; at 2 it runs no faster and takes a tenth more to
compile."""

UNROLL_LOOPS = False
"""Whether LLVM unrolls loops: a step already has hundreds of instructions, and twice as many run 7 % slower, because
they exceed the processor's cache of decoded instructions; they take a third more to compile."""

_LINKING_LOCK = threading.Lock()
_LOADED: list[Any] = []
"""References that keep machine code in memory."""


@cache
def binding() -> Any:
    """Return llvmlite's binding, ready to compile for this processor."""
    import llvmlite.binding

    llvmlite.binding.initialize_native_target()
    llvmlite.binding.initialize_native_asmprinter()
    return llvmlite.binding


@cache
def target() -> str:
    """Return what machine code depends on besides its kernel: LLVM, processor and optimisation level."""
    llvm = binding()
    features = llvm.get_host_cpu_features().flatten()
    version = ".".join(map(str, llvm.llvm_version_info))
    import llvmlite

    how = f"O{OPTIMISATION_LEVEL} unrolled {UNROLL_LOOPS}"
    return f"{llvmlite.__version__} {version} {llvm.get_default_triple()} {llvm.get_host_cpu_name()} {features} {how}"


@cache
def native_width() -> int:
    """Return the number of doubles in one of the processor's vectors."""
    features = binding().get_host_cpu_features()
    return 8 if features.get("avx512f") else 4 if features.get("avx") else 2


def _machine() -> Any:
    llvm = binding()
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=llvm.get_host_cpu_name(),
        features=llvm.get_host_cpu_features().flatten(),
        opt=OPTIMISATION_LEVEL,
        reloc="pic",
        codemodel="jitdefault",
    )


def assemble(text: str) -> bytes:
    """Return machine code.

    Parameters
    ----------
    text : str
        LLVM's intermediate representation.

    Returns
    -------
    bytes
        An object file.
    """
    llvm, machine = binding(), _machine()
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = machine.triple, str(machine.target_data)
    options = llvm.create_pipeline_tuning_options(speed_level=OPTIMISATION_LEVEL)
    options.loop_vectorization, options.slp_vectorization = True, False
    options.loop_unrolling = UNROLL_LOOPS
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return bytes(machine.emit_object(module))


@cache
def _linker() -> Any:
    return binding().create_lljit_compiler(_machine())


def load_and_link(name: str, code: bytes, symbols: Sequence[str]) -> Mapping[str, int]:
    """Load machine code and return the addresses of functions.

    Parameters
    ----------
    name : str
        A unique name of the code.
    code : bytes
        An object file.
    symbols : sequence of str
        Names of the functions.
    """
    with _LINKING_LOCK:
        library = binding().JITLibraryBuilder().add_object_img(code).add_current_process()
        for symbol in symbols:
            library = library.export_symbol(symbol)
        loaded = library.link(_linker(), f"{name}.{len(_LOADED)}")
        _LOADED.append(loaded)
        return {symbol: loaded[symbol] for symbol in symbols}


def as_callable(address: int) -> Any:
    """Return a Python callable for the function at an address; it takes two pointers and releases Python's lock."""
    return ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(address)
