"""Meaning of names in a translated loop: numbers, and arrays whose shapes are known when the C code is written."""

from dataclasses import dataclass
from math import prod
from typing import TypeAlias


@dataclass(frozen=True)
class Scalar:
    """A number: a C expression that is ``int`` or ``real``.

    Parameters
    ----------
    root : str
        The array of which it is an element.
    """

    text: str
    whole: bool = False
    root: str = ""


@dataclass(frozen=True)
class Block:
    """An array of known shape, row by row in memory.

    Parameters
    ----------
    text : str
        C expression that points at its first element.
    root : str
        The parameter to which it belongs, which counts as written if one of its elements is written.
    """

    text: str
    shape: tuple[int, ...]
    root: str
    whole: bool = False

    def at(self, places: list[str]) -> "Block | Scalar":
        """Return an element, or a sub-array if there are fewer indices than dimensions.

        Parameters
        ----------
        places : list of str
            C expressions of the leading indices.

        Returns
        -------
        Block or Scalar
            A row if dimensions remain, else a number.

        Examples
        --------
        >>> Block("seen", (9, 2, 3), "seen").at(["i", "0", "c"]).text
        'seen[(i) * 6 + (0) * 3 + c]'
        """
        rest = self.shape[len(places) :]
        strides = [prod(self.shape[i + 1 :]) for i in range(len(places))]
        offset = " + ".join(
            place if stride == 1 else f"({place}) * {stride}" for place, stride in zip(places, strides, strict=True)
        )
        if rest:
            return Block(f"({self.text} + {offset})", rest, self.root, self.whole)
        return Scalar(f"{self.text}[{offset}]", self.whole, self.root)


Group: TypeAlias = "tuple[Thing, ...]"
Thing: TypeAlias = "Scalar | Block | Group"
"""What a name or an argument may be; a group is passed on as its members."""


def kind_of(thing: Thing) -> object:
    """Return the kind of a thing; one translated function serves all things of the same kind.

    Parameters
    ----------
    thing : Scalar, Block or tuple of them
        An argument [any unit].
    """
    match thing:
        case Scalar():
            return "int" if thing.whole else "real"
        case Block():
            return thing.shape, thing.whole
        case _:
            return tuple(kind_of(one) for one in thing)


def flat_parameters(name: str, thing: Thing) -> list[tuple[str, "Scalar | Block"]]:
    """Return a thing as parameters of C, groups expanded.

    Parameters
    ----------
    name : str
        The parameter's name.
    thing : Scalar, Block or tuple of them
        The thing [any unit].

    Returns
    -------
    list of (str, Scalar or Block)
        Name and thing of each parameter.
    """
    if isinstance(thing, tuple):
        return [pair for i, one in enumerate(thing) for pair in flat_parameters(f"{name}_{i}", one)]
    return [(name, thing)]


def as_parameter(name: str, thing: Thing) -> Thing:
    """Return a thing under its name inside the function that receives it.

    Parameters
    ----------
    thing : Scalar, Block or tuple of them
        An argument [any unit].

    Returns
    -------
    Scalar, Block or tuple of them
        The same thing under its name there.
    """
    match thing:
        case Scalar():
            return Scalar(name, thing.whole)
        case Block():
            return Block(name, thing.shape, name, thing.whole)
        case _:
            return tuple(as_parameter(f"{name}_{i}", one) for i, one in enumerate(thing))
