"""Plain loops of a module, compiled at their first call together with all loops that they call."""

import functools
from collections.abc import Callable, Collection
from typing import Any, Generic, ParamSpec, TypeVar

from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature_of
from plant.compiled.paste import functions_text

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


class Loop(Generic[Parameters, Result]):
    """A loop that is compiled at its first call.

    Parameters
    ----------
    function : callable
        The Python function, available as ``__wrapped__``, to be run in Python.
    freely : collection of str
        Flags that say how freely LLVM may rearrange its arithmetic.
    """

    __wrapped__: Callable[Parameters, Result]

    def __init__(self, function: Callable[Parameters, Result], freely: Collection[str]) -> None:
        functools.update_wrapper(self, function)
        self.freely = sorted(freely)
        self._kernel: Callable[..., Any] | None = None

    def __call__(self, *args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        """Run the machine code; the documented shapes are checked."""
        if self._kernel is None:
            self._kernel = self._compile()
        return self._kernel(*args, **kwargs)

    def _compile(self) -> Callable[..., Any]:
        function = self.__wrapped__
        name = function.__name__
        takes = {name: signature_of(function)}
        return getattr(load_native(name, lambda: text_of(self), takes, (function, self.freely)), name)


def text_of(loop: Loop[..., Any]) -> str:
    """Return the text of a kernel: a loop, all that it calls, and their constants."""
    loops, constants = dependencies(loop)
    texts = [functions_text(one.__wrapped__, freely=one.freely) for one in loops]
    return "\n\n".join([*(f"{key} = {value!r}" for key, value in constants.items()), *texts])


def dependencies(loop: Loop[..., Any]) -> tuple[list[Loop[..., Any]], dict[str, object]]:
    """Return a loop and all loops that it calls, and the constants of their modules that they read.

    Raises
    ------
    NameError
        If two loops or constants of different modules have one name.
    """
    found, constants, waiting = dict[str, Loop[..., Any]](), dict[str, object](), [loop]
    while waiting:
        one = waiting.pop()
        if found.setdefault(one.__wrapped__.__name__, one) is not one:
            raise NameError(f"two loops are named {one.__wrapped__.__name__}")
        there = one.__wrapped__.__globals__  # type: ignore[attr-defined]  # a function has them
        for name in one.__wrapped__.__code__.co_names:  # type: ignore[attr-defined]
            value = there.get(name)
            if isinstance(value, Loop) and found.get(name) is not value:
                waiting.append(value)
            elif isinstance(value, int | float) and constants.setdefault(name, value) != value:
                raise NameError(f"two constants are named {name}")
    return [found[name] for name in sorted(found)], dict(sorted(constants.items()))


def natively_compiled(
    *, freely: Collection[str] = ()
) -> Callable[[Callable[Parameters, Result]], Loop[Parameters, Result]]:
    """Return a decorator that compiles a loop at its first call, together with the loops that it calls.

    Parameters
    ----------
    freely : collection of str
        How freely LLVM may rearrange arithmetic, by LLVM's names: ``reassoc`` lets sums vectorise.

    Examples
    --------
    >>> import numpy as np
    >>> @natively_compiled()
    ... def total(values):
    ...     '''Return a sum.
    ...
    ...     Parameters
    ...     ----------
    ...     values : ndarray, shape (n,)
    ...         Numbers.
    ...     '''
    ...     result = 0.0
    ...     for value in values:
    ...         result += value
    ...     return result
    >>> total(np.arange(4.0))
    6.0
    """
    return lambda function: Loop(function, freely)
