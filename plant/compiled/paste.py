"""Pastes functions into a kernel's text: loops that linters, type checkers and tests see as ordinary Python.

A kernel contains all that it calls (`plant.compiled.native.load`). So its loops are written as functions of a
module, and their source is copied; what tracing a model generates stands beside them, under the names by which they
call it. In its own module such a name is a declaration, a keyword-only parameter without default, or an attribute of a
parameter ``kernel``, which stands for the kernel: whoever runs the function as it is, in Python, passes them.
"""

import ast
import inspect
from collections.abc import Callable, Collection, Mapping
from functools import cache

KERNEL = "kernel"
"""Name of the parameter that stands for a kernel."""

INLINED = "@inlined\n"
"""What stands above a function that becomes a part of whoever calls it."""


def pasted(
    *functions: Callable[..., object],
    constants: Mapping[str, object] | None = None,
    inlined: bool = False,
    freely: Collection[str] = (),
) -> str:
    """Return the text of functions, for a kernel.

    Annotations, docstrings and comments stay behind: who edits one of them has nothing to compile anew.

    Parameters
    ----------
    *functions : callable
        Functions of a module, without decorators. They may call each other, in any order.
    constants : Mapping[str, object], optional
        Values of names that the functions read, bound above them.
    inlined : bool
        Whether they become a part of whoever calls them.
    freely : collection of str
        How freely LLVM may rearrange their arithmetic, as it names it.

    Examples
    --------
    >>> def grown(size: float) -> float:
    ...     return SHARE * size
    >>> print(pasted(grown, constants={"SHARE": 0.5}, inlined=True))
    SHARE = 0.5
    <BLANKLINE>
    <BLANKLINE>
    @inlined
    def grown(size):
        return SHARE * size
    """
    bound = [f"{name} = {value!r}" for name, value in (constants or {}).items()]
    above = (INLINED if inlined else "") + (f"@freely{tuple(sorted(freely))}\n" if freely else "")
    texts = [above + bare_text(function) for function in functions]
    return "\n\n\n".join(["\n".join(bound), *texts] if bound else texts)


def kernel_text(title: str, *parts: str) -> str:
    """Return the text of a kernel.

    Parameters
    ----------
    title : str
        What the kernel does, for its docstring.
    *parts : str
        Functions and constants, in any order.

    Returns
    -------
    str
        The text: ``math`` and ``numpy`` are imported, then the parts follow.
    """
    return "\n\n\n".join([f'"""Generated: {title}."""\n\nimport math\n\nimport numpy as np', *parts]) + "\n"


@cache
def bare_text(function: Callable[..., object]) -> str:
    """Return a function's source without annotations, docstring and comments.

    A keyword-only parameter without default becomes a name of the file, and so does what a parameter ``kernel`` has;
    no call hands them on any more.

    Examples
    --------
    >>> def middle(low: float, high: float) -> float:
    ...     return 0.5 * (low + high)  # left out
    >>> print(bare_text(middle))
    def middle(low, high):
        return 0.5 * (low + high)
    >>> def scaled(low: float, high: float, *, SHARE: float) -> float:
    ...     return SHARE * middle(low, high)
    >>> print(bare_text(scaled))
    def scaled(low, high):
        return SHARE * middle(low, high)
    >>> def shifted(kernel, low, high):
    ...     return kernel.SHIFT + middle(low, high)
    >>> print(bare_text(shifted))
    def shifted(low, high):
        return SHIFT + middle(low, high)
    """
    definition = ast.parse(inspect.getsource(function)).body[0]
    if not isinstance(definition, ast.FunctionDef):
        raise TypeError(f"only a function that is written with def can be pasted, got {function!r}")
    if ast.get_docstring(definition) is not None:
        definition.body = definition.body[1:] or [ast.Pass()]
    definition.returns = None
    definition.decorator_list = []
    arguments = definition.args
    arguments.args = [argument for argument in arguments.args if argument.arg != KERNEL]
    for argument in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
        argument.annotation = None
    keywords = list(zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True))
    bound = {argument.arg for argument, default in keywords if default is None}
    arguments.kwonlyargs = [argument for argument, default in keywords if default is not None]
    arguments.kw_defaults = [default for _, default in keywords if default is not None]
    for node in ast.walk(definition):
        if isinstance(node, ast.Call):
            node.keywords = [keyword for keyword in node.keywords if keyword.arg not in bound]
    return ast.unparse(_OfTheFile().visit(definition))


class _OfTheFile(ast.NodeTransformer):
    """Turns what a kernel has into names, and hands no kernel on."""

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        self.generic_visit(node)
        return ast.Name(node.attr, node.ctx) if _is_kernel(node.value) else node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        node.args = [argument for argument in node.args if not _is_kernel(argument)]
        return node


def _is_kernel(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id == KERNEL
