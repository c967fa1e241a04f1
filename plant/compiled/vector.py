"""Machine instructions from straight lines of Python, for one number or for several side by side.

Numba infers the type of every line, which takes far longer than to write its instruction down. So a kernel's lines are
called once, while it is compiled, with a `Vector` for each symbol, and what they do to it is written down
(`plant.compiled.intrinsics`). The same lines serve one filter and many side by side, and give both the same bits.
"""

import math
from typing import Any

from llvmlite import ir

DOUBLE, WORD, SHORT = ir.DoubleType(), ir.IntType(64), ir.IntType(32)


def vector_type(width: int) -> Any:
    """Return the type of so many numbers side by side.

    Parameters
    ----------
    width : int
        How many.

    Returns
    -------
    llvmlite.ir.Type
        The type; of one number, a double.
    """
    return DOUBLE if width == 1 else ir.VectorType(DOUBLE, width)


class Vector:
    """What a symbol stands for while a kernel is compiled: one number, or several side by side.

    Parameters
    ----------
    builder : llvmlite.ir.IRBuilder
        Writes instructions.
    value : llvmlite.ir.Value
        Numbers, or what a comparison of numbers gives.
    """

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    @property
    def width(self) -> int:
        """How many."""
        return getattr(self.value.type, "count", 1)

    def like(self, other: "Vector | float") -> Any:
        """Return a value to compute with: of another vector its own, of a number as many of it.

        Parameters
        ----------
        other : Vector or float
            The other [any unit].

        Returns
        -------
        llvmlite.ir.Value
            Its value.
        """
        if isinstance(other, Vector):
            return other.value
        return ir.Constant(vector_type(self.width), other if self.width == 1 else [other] * self.width)

    def _made(self, instruction: str, a: "Vector | float", b: "Vector | float") -> "Vector":
        return Vector(self.builder, getattr(self.builder, instruction)(self.like(a), self.like(b)))

    def _compared(self, how: str, other: "Vector | float") -> "Vector":
        return Vector(self.builder, self.builder.fcmp_ordered(how, self.value, self.like(other)))

    def of(self, name: str, *others: "Vector | float") -> "Vector":
        """Apply an instruction.

        Parameters
        ----------
        name : str
            The instruction, as LLVM names it.
        *others : Vector or float
            Its further operands [any unit].

        Returns
        -------
        Vector
            The result.
        """
        kind, module = vector_type(self.width), self.builder.module
        full = f"llvm.{name}.f64" if self.width == 1 else f"llvm.{name}.v{self.width}f64"
        values = [self.value, *(self.like(other) for other in others)]
        function = module.globals.get(full) or ir.Function(module, ir.FunctionType(kind, [kind] * len(values)), full)
        return Vector(self.builder, self.builder.call(function, values))

    def each(self, name: str) -> "Vector":
        """Apply a function of the C library to every number.

        Parameters
        ----------
        name : str
            The function.

        Returns
        -------
        Vector
            The results.
        """
        builder, module = self.builder, self.builder.module
        function = module.globals.get(name) or ir.Function(module, ir.FunctionType(DOUBLE, [DOUBLE]), name)
        if self.width == 1:
            return Vector(builder, builder.call(function, [self.value]))
        result = self.value
        for place in map(SHORT, range(self.width)):
            one = builder.call(function, [builder.extract_element(self.value, place)])
            result = builder.insert_element(result, one, place)
        return Vector(builder, result)

    def __add__(self, other: "Vector | float") -> "Vector":
        return self._made("fadd", self, other)

    def __radd__(self, other: float) -> "Vector":
        return self._made("fadd", other, self)

    def __sub__(self, other: "Vector | float") -> "Vector":
        return self._made("fsub", self, other)

    def __rsub__(self, other: float) -> "Vector":
        return self._made("fsub", other, self)

    def __mul__(self, other: "Vector | float") -> "Vector":
        return self._made("fmul", self, other)

    def __rmul__(self, other: float) -> "Vector":
        return self._made("fmul", other, self)

    def __truediv__(self, other: "Vector | float") -> "Vector":
        return self._made("fdiv", self, other)

    def __rtruediv__(self, other: float) -> "Vector":
        return self._made("fdiv", other, self)

    def __neg__(self) -> "Vector":
        return Vector(self.builder, self.builder.fneg(self.value))

    def __abs__(self) -> "Vector":
        return self.of("fabs")

    def __lt__(self, other: "Vector | float") -> "Vector":
        return self._compared("<", other)

    def __le__(self, other: "Vector | float") -> "Vector":
        return self._compared("<=", other)

    def __gt__(self, other: "Vector | float") -> "Vector":
        return self._compared(">", other)

    def __ge__(self, other: "Vector | float") -> "Vector":
        return self._compared(">=", other)


def present(x: Any) -> Any:
    """Return whether a value is a number.

    Parameters
    ----------
    x : Vector
        Any unit.

    Returns
    -------
    Vector
        Whether it is.
    """
    return Vector(x.builder, x.builder.fcmp_ordered("ord", x.value, x.value))


def where(condition: Any, a: Any, b: Any) -> Any:
    """Return a where the condition holds, else b.

    Parameters
    ----------
    condition : Vector
        A comparison.
    a, b : Vector or float
        The two values, in one unit.

    Returns
    -------
    Vector or float
        The chosen value.
    """
    if not isinstance(condition, Vector):
        return a if condition else b
    return Vector(condition.builder, condition.builder.select(condition.value, condition.like(a), condition.like(b)))


def sign(x: Any) -> Any:
    """Return -1, 0 or 1.

    Parameters
    ----------
    x : Vector or float
        Any unit.

    Returns
    -------
    Vector or float
        The sign.
    """
    return where(x > 0.0, 1.0, where(x < 0.0, -1.0, 0.0))


def fma(a: Any, b: Any, c: Any) -> Any:
    """Return ``a * b + c``, rounded once.

    Parameters
    ----------
    a, b, c : Vector or float
        One of them a vector, any unit.

    Returns
    -------
    Vector
        The sum.
    """
    one = next(value for value in (a, b, c) if isinstance(value, Vector))
    return Vector(one.builder, one.like(a)).of("fma", b, c)


def sqrt(x: Any) -> Any:
    """Return the square root.

    Parameters
    ----------
    x : Vector or float
        Not negative, any unit.

    Returns
    -------
    Vector or float
        Its root.
    """
    return x.of("sqrt") if isinstance(x, Vector) else math.sqrt(x)


def roots(values: tuple[Any, ...]) -> list[Any]:
    """Return square roots, of single numbers by one instruction.

    Parameters
    ----------
    values : tuple of Vector
        Not negative, any unit.

    Returns
    -------
    list of Vector
        Their roots.
    """
    if values[0].width > 1:
        return [sqrt(value) for value in values]
    return _apart(_beside(values).of("sqrt"), len(values))


def ratios(above: tuple[Any, ...], below: tuple[Any, ...]) -> list[Any]:
    """Return quotients, of single numbers by one instruction.

    Parameters
    ----------
    above, below : tuple of Vector or float
        Dividends and divisors [any unit].

    Returns
    -------
    list of Vector
        The quotients.
    """
    one = next(value for value in (*above, *below) if isinstance(value, Vector))
    if one.width > 1:
        return [a / b for a, b in zip(above, below, strict=True)]
    return _apart(_beside(above, one) / _beside(below, one), len(above))


def _beside(values: tuple[Any, ...], one: Any = None) -> Vector:
    """Return single numbers as one vector."""
    builder = (one or values[0]).builder
    result: Any = ir.Constant(vector_type(len(values)), [1.0] * len(values))
    for place, value in enumerate(values):
        single = value.value if isinstance(value, Vector) else DOUBLE(value)
        result = builder.insert_element(result, single, SHORT(place))
    return Vector(builder, result)


def _apart(many: Vector, count: int) -> list[Vector]:
    """Return the numbers of a vector."""
    return [Vector(many.builder, many.builder.extract_element(many.value, SHORT(place))) for place in range(count)]


def exp(x: Any) -> Any:
    """Return e to the power x.

    Parameters
    ----------
    x : Vector or float
        Dimensionless.

    Returns
    -------
    Vector or float
        The exponential.
    """
    return x.each("exp") if isinstance(x, Vector) else math.exp(x)


def log(x: Any) -> Any:
    """Return the natural logarithm.

    Parameters
    ----------
    x : Vector or float
        Positive, dimensionless.

    Returns
    -------
    Vector or float
        Its logarithm.
    """
    return x.each("log") if isinstance(x, Vector) else math.log(x)


def tanh(x: Any) -> Any:
    """Return the hyperbolic tangent.

    Parameters
    ----------
    x : Vector or float
        Dimensionless.

    Returns
    -------
    Vector or float
        Between -1 and 1.
    """
    return x.each("tanh") if isinstance(x, Vector) else math.tanh(x)
