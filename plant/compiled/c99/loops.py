"""Loops as C: a kernel's typed Python functions, for arrays whose shapes are known when the C code is written.

A function is translated for the shapes of its arguments, together with all functions that it calls. Loops are ``for``
over ``range`` or over an array, so each is bounded, and the largest number of operations of a call is counted during
the translation. All other Python is refused, with its line number.
"""

import ast
import inspect
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from plant.compiled.c99.body import Body
from plant.compiled.c99.precision import Precision
from plant.compiled.c99.shapes import Block, Scalar, Thing, as_parameter, flat_parameters, kind_of
from plant.compiled.paste import bare_text


@dataclass(frozen=True)
class ExternalFunction:
    """A function that already exists in C.

    Parameters
    ----------
    name : str
        Its name in C.
    written : tuple of bool
        Whether it writes to each of its arguments.
    operations : Counter
        Largest number of operations of a call [operations].
    """

    name: str
    written: tuple[bool, ...]
    operations: Counter[str]


@dataclass(frozen=True)
class TranslatedFunction:
    """A function in C.

    Parameters
    ----------
    name, text : str
        Its name, and its definition.
    written : tuple of bool
        Whether it writes to each of its parameters, groups expanded.
    operations : Counter
        Largest number of operations of a call [operations].
    results : tuple of bool
        For each result, whether it is an integer; results after the first are returned through pointers.
    """

    name: str
    text: str
    written: tuple[bool, ...]
    operations: Counter[str]
    results: tuple[bool, ...]


@dataclass
class Translation:
    """Functions of a kernel, each translated when it is called.

    Parameters
    ----------
    functions : Mapping[str, callable]
        The Python functions, by name.
    constants : Mapping[str, int]
        Integers that the functions read by name.
    outside : Mapping[str, ExternalFunction]
        Functions called that already exist in C.
    prefix : str
        Prefix of the names of their translations.
    """

    functions: Mapping[str, Callable[..., object]]
    constants: Mapping[str, int]
    outside: Mapping[str, ExternalFunction]
    precision: Precision
    prefix: str
    _done: dict[tuple[str, object], TranslatedFunction] = field(
        default_factory=dict[tuple[str, object], TranslatedFunction]
    )

    def translate(
        self, name: str, given: Sequence[Thing], known: Mapping[str, int] | None = None
    ) -> TranslatedFunction:
        """Translate a function for the shapes of its arguments.

        Parameters
        ----------
        given : sequence of Scalar, Block or groups of them
            Its arguments [any unit].
        known : Mapping[str, int], optional
            Integer parameters that always have one value.

        Returns
        -------
        TranslatedFunction
            The function; `text` also has all functions that it calls.
        """
        key = name, tuple(kind_of(one) for one in given)
        if key not in self._done:
            self._done[key] = self._translate(name, given, known or {})
        return self._done[key]

    @property
    def text(self) -> str:
        """All functions, each after those that it calls."""
        return "\n\n".join(one.text for one in self._done.values())

    def _translate(self, name: str, given: Sequence[Thing], known: Mapping[str, int]) -> TranslatedFunction:
        function = self.functions[name]
        (node,) = ast.parse(bare_text(function)).body
        assert isinstance(node, ast.FunctionDef)  # noqa: S101  bare_text sees to it
        pairs = list(zip((argument.arg for argument in node.args.args), given, strict=True))
        names = {called: as_parameter(called, thing) for called, thing in pairs}
        names |= {called: Scalar(str(value), True) for called, value in known.items()}
        body = Body(self, names, node)
        lines = body.block(node.body)
        flat = [one for called, thing in pairs if called not in known for one in flat_parameters(called, thing)]
        spelt = [self._parameter(called, thing, called in body.written) for called, thing in flat]
        spelt += [f"{self._type(whole)} *result_{i}" for i, whole in enumerate(body.results) if i > 0]
        variants = sum(known == name for known, _ in self._done)
        in_c = f"{self.prefix}_{name}{f'_{variants + 1}' if variants else ''}"
        head = f"static {self._type(body.results[0]) if body.results else 'void'} {in_c}({', '.join(spelt)})"
        declared = [f"{self._type(whole)} {local} = 0;" for local, whole in body.locals.items()]
        about = (inspect.getdoc(function) or name).splitlines()[0]
        text = "\n".join([f"/* {about} */", head, "{", *(f"    {line}" for line in [*declared, *lines]), "}"])
        return TranslatedFunction(
            in_c, text, tuple(called in body.written for called, _ in flat), body.counted, body.results
        )

    def _type(self, whole: bool) -> str:
        return "int" if whole else self.precision.name

    def _parameter(self, name: str, thing: Scalar | Block, written: bool) -> str:
        if isinstance(thing, Scalar):
            return f"{'' if written else 'const '}{self._type(thing.whole)} {name}"
        return f"{'' if written else 'const '}{self._type(thing.whole)} *{name}"
