"""The public API is documented: docstrings, arguments, units, shapes.

Each rule is also tested on an invented offender. Everything public has a docstring. Its floats and arrays, and no
unknown names, are listed under Parameters with unit or shape. A docstring of more than one line on a function that
returns floats or arrays has a Returns section. Protocol members with a body of ``...``, and methods that override
another of ours, need no sections. Commands are checked by their help.
"""

import ast
import inspect
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

from plant.units import unit_registry

ROOT = Path(__file__).resolve().parents[1]
LAYERS = ("plant", "estimation", "faults", "experiments")
UNIT_WORDS = re.compile(
    r"\b(?:dimensionless|counts?|fractions?|probabilit(?:y|ies)|percent|SI|units? of|(?:any|one) unit)\b",
    re.IGNORECASE,
)
UNIT_SUFFIX = re.compile(r"_(?:percent|hz|k?pa|bar|psi|m?m|m?s|m?m_s2?|rad|rad_s|rpm|n|kg|v)$")
FLOATS = frozenset({"float", "Scalar"})
ARRAYS = frozenset({"NDArray", "ndarray", "ArrayLike"})
ENTRY = re.compile(r"(?P<names>\*{0,2}\w+(?:, *\*{0,2}\w+)*)(?: *: *(?P<type>.*))?")

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Entry:
    """The description of one argument in a docstring: the type after the colon, and the lines below."""

    type_line: str
    description: str


def sections(docstring: str) -> dict[str, list[str]]:
    """Split a numpydoc docstring at its underlined headings."""
    found: dict[str, list[str]] = {"": []}
    current = ""
    lines = inspect.cleandoc(docstring).splitlines()
    for line, after in zip(lines, [*lines[1:], ""], strict=True):
        if line and re.fullmatch(r"-{3,}", after) and len(after) == len(line):
            current = line
            found[current] = []
        elif not re.fullmatch(r"-{3,}", line):
            found[current].append(line)
    return found


def entries(lines: Sequence[str]) -> dict[str, Entry]:
    """Return the arguments of a Parameters section; ``a, b : float`` describes both."""
    found: dict[str, Entry] = {}
    names: list[str] = []
    for line in lines:
        heading = ENTRY.fullmatch(line)
        if heading:
            names = [name.strip().lstrip("*") for name in heading["names"].split(",")]
            found |= {name: Entry(heading["type"] or "", "") for name in names}
        else:
            found |= {n: Entry(found[n].type_line, f"{found[n].description} {line.strip()}") for n in names}
    return found


@cache
def is_unit(text: str) -> bool:
    try:
        unit_registry().parse_units(text)
    except Exception:  # pint raises many kinds of error, all of which mean no
        return False
    return True


def has_unit(text: str) -> bool:
    """Return whether a description holds ``[a unit]``, or states in words that there is none or whose it is."""
    brackets = re.findall(r"\[([^\[\]]+)\]", text)
    return bool(UNIT_WORDS.search(text)) or any(is_unit(said) or "unit" in said for said in brackets)


def _mentions(annotation: ast.expr | None, names: frozenset[str]) -> bool:
    match annotation:
        case None:
            return False
        case ast.Constant(value=str(quoted)):
            return _mentions(ast.parse(quoted, mode="eval").body, names)
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name in names
        case ast.Subscript(value=ast.Name(id="Annotated"), slice=ast.Tuple(elts=[kind, *_])):
            return _mentions(kind, names)
        case ast.Subscript(value=ast.Name(id="Callable") | ast.Attribute(attr="Callable")):
            return False
        case _:
            parts = (child for child in ast.iter_child_nodes(annotation) if isinstance(child, ast.expr))
            return any(_mentions(part, names) for part in parts)


@dataclass(frozen=True)
class Page:
    """One public module, and the project-wide aliases of float and array types."""

    path: str
    tree: ast.Module
    floats: frozenset[str] = FLOATS
    arrays: frozenset[str] = ARRAYS
    pasted: frozenset[str] = frozenset()
    methods: frozenset[tuple[str, str]] = frozenset()

    def offence(self, node: ast.AST, name: str, problem: str) -> str:
        return f"{self.path}:{getattr(node, 'lineno', 1)}: {name} {problem}"


def _aliases(tree: ast.Module, names: frozenset[str]) -> Iterator[str]:
    for node in tree.body:
        match node:
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                aliased = isinstance(value, ast.Subscript | ast.BinOp | ast.Name)
            case ast.AnnAssign(target=ast.Name(id=name), annotation=ast.Name(id="TypeAlias"), value=value):
                aliased = True
            case _:
                continue
        if aliased and not name.isupper() and _mentions(value, names):
            yield name


def pages(texts: dict[str, str]) -> list[Page]:
    """Parse the public modules among files given by their paths relative to the project."""
    trees = {path: ast.parse(text, filename=path) for path, text in texts.items()}
    floats = FLOATS.union(*(_aliases(tree, FLOATS) for tree in trees.values()))
    arrays = ARRAYS.union(*(_aliases(tree, ARRAYS) for tree in trees.values()))
    public = {path: tree for path, tree in trees.items() if not re.search(r"/_(?!_init__)", path)}
    pasted = frozenset(name for tree in trees.values() for name in _pasted(tree))
    classes = [node for tree in trees.values() for node in tree.body if isinstance(node, ast.ClassDef)]
    methods = frozenset((one.name, item.name) for one in classes for item in one.body if isinstance(item, Function))
    return [Page(path, tree, floats, arrays, pasted, methods) for path, tree in public.items()]


def _pasted(tree: ast.Module) -> Iterator[str]:
    """Yield the functions that are pasted into kernel files: parts of one loop, with no other caller."""
    named = {
        target.id: node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Tuple)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "functions_text":
            names = [one.id for given in node.args for one in ast.walk(given) if isinstance(one, ast.Name)]
            listed = (named[name] for name in names if name in named)
            yield from (*names, *(one.id for given in listed for one in ast.walk(given) if isinstance(one, ast.Name)))


def _decorators(node: Function | ast.ClassDef) -> set[str]:
    calls = (item.func if isinstance(item, ast.Call) else item for item in node.decorator_list)
    return {ast.unparse(call).rsplit(".", 1)[-1] for call in calls}


def _bases(node: ast.ClassDef) -> set[str]:
    values = (base.value if isinstance(base, ast.Subscript) else base for base in node.bases)
    return {ast.unparse(value).rsplit(".", 1)[-1] for value in values}


def _is_stub(node: Function) -> bool:
    last = node.body[-1]
    return isinstance(last, ast.Expr) and isinstance(last.value, ast.Constant)


def _arguments(node: Function, *, method: bool) -> dict[str, ast.expr | None]:
    spec = node.args
    positional = [*spec.posonlyargs, *spec.args]
    if method and "staticmethod" not in _decorators(node):
        positional = positional[1:]
    starred = [item for item in (spec.vararg, spec.kwarg) if item is not None]
    return {item.arg: item.annotation for item in (*positional, *spec.kwonlyargs, *starred)}


def _fields(node: ast.ClassDef) -> dict[str, ast.expr | None]:
    """Return the arguments of a class's constructor: its fields without an SI note, or those of `__init__`."""
    if "dataclass" in _decorators(node) or _bases(node) & {"NamedTuple", "BaseModel"}:
        return {
            item.target.id: item.annotation
            for item in node.body
            if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name)
            if not item.target.id.startswith("_") and "init=False" not in ast.unparse(item)
            if not re.match(r"(typing\.)?ClassVar\b|.*\bSI\(|.* = si\(", ast.unparse(item).partition(": ")[2])
        }
    found = [item for item in node.body if isinstance(item, Function) and item.name == "__init__"]
    return _arguments(found[0], method=True) if found else {}


def _argument_offences(
    page: Page, node: Function | ast.ClassDef, name: str, arguments: dict[str, ast.expr | None]
) -> Iterator[str]:
    found = sections(ast.get_docstring(node) or "")
    described = entries(found.get("Parameters", []))
    for stale in () if isinstance(node, ast.ClassDef) else described.keys() - arguments.keys():
        yield page.offence(node, name, f"describes {stale!r}, which it does not take")
    if isinstance(node, ast.ClassDef):
        described |= entries(found.get("Attributes", []))
    for argument, annotation in arguments.items():
        entry = described.get(argument)
        if entry is None:
            if _mentions(annotation, page.floats | page.arrays):
                yield page.offence(node, name, f"does not list {argument!r} under Parameters")
            continue
        says_unit = UNIT_SUFFIX.search(argument) or has_unit(f"{entry.type_line} {entry.description}")
        if _mentions(annotation, page.floats) and not says_unit and not entry.type_line.startswith("bool"):
            yield page.offence(node, name, f"gives no [unit] of {argument!r}")
        if _mentions(annotation, page.arrays) and "shape" not in entry.type_line:
            yield page.offence(node, name, f"gives no shape of {argument!r} in its type line")


def _function_offences(page: Page, node: Function, name: str, owner: ast.ClassDef | None) -> Iterator[str]:
    decorators = _decorators(node)
    if decorators & {"overload", "setter", "deleter"}:
        return
    docstring = ast.get_docstring(node)
    if docstring is None:
        yield page.offence(node, name, "has no docstring")
        return
    inside = page.path.startswith(("experiments/cli.py", "experiments/verbs/")) or page.path.endswith("/command.py")
    command = inside and bool(decorators & {"command", "callback"})
    bases = set() if owner is None else _bases(owner)
    overrides = any((base, node.name) in page.methods for base in bases)
    if node.name in page.pasted or command or overrides or ("Protocol" in bases and _is_stub(node)):
        return
    yield from _argument_offences(page, node, name, _arguments(node, method=owner is not None))
    numbers = _mentions(node.returns, page.floats | page.arrays) and not decorators & {"property", "cached_property"}
    if "\n" in docstring and numbers and not sections(docstring).keys() & {"Returns", "Yields"}:
        yield page.offence(node, name, f"does not say under Returns what its {ast.unparse(node.returns)} is")


def documentation_offences(page: Page) -> Iterator[str]:
    """Return every missing docstring, argument, unit, shape and Returns section of one public module."""
    if ast.get_docstring(page.tree) is None:
        yield page.offence(page.tree, "the module", "has no docstring")
    for node in page.tree.body:
        if not isinstance(node, Function | ast.ClassDef) or node.name.startswith("_"):
            continue
        if isinstance(node, Function):
            yield from _function_offences(page, node, node.name, None)
            continue
        if ast.get_docstring(node) is None:
            yield page.offence(node, node.name, "has no docstring")
        elif "Protocol" not in _bases(node):
            yield from _argument_offences(page, node, node.name, _fields(node))
        for member in node.body:
            if isinstance(member, Function) and not member.name.startswith("_"):
                yield from _function_offences(page, member, f"{node.name}.{member.name}", node)


def _read() -> list[Page]:
    paths = [path for layer in LAYERS for path in sorted((ROOT / layer).rglob("*.py"))]
    return pages({path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in paths})


OFFENDERS = {
    "module": ("x = 1", "has no docstring"),
    "class": ("class A: ...", "A has no docstring"),
    "function": ("def f(): ...", "f has no docstring"),
    "method": ('class A:\n    """A."""\n    def f(self): ...', "A.f has no docstring"),
    "protocol member": ('class A(Protocol):\n    """A."""\n    def f(self): ...', "A.f has no docstring"),
    "one line": ('def f(x: float) -> int:\n    """F."""', "f does not list 'x'"),
    "starred": ('def f(*rest: float):\n    """F."""', "f does not list 'rest'"),
    "keyword": ('def f(*, x: NDArray):\n    """F.\n\n    Parameters\n    ----------\n    """', "not list 'x'"),
    "stale": ('def f():\n    """F.\n\n    Parameters\n    ----------\n    x : int\n    """', "describes 'x'"),
    "field": ('@dataclass(frozen=True)\nclass A:\n    """A."""\n    x: float', "A does not list 'x'"),
    "constructor": ('class A:\n    """A."""\n    def __init__(self, x: float): ...', "A does not list 'x'"),
    "returns": ('def f() -> float:\n    """F.\n\n    More.\n    """', "under Returns what its float is"),
}

DESCRIBED = (
    'def f({signature}):\n    """F.\n\n    Parameters\n    ----------\n    {entry}\n        {description}\n    """\n'
)


@pytest.mark.parametrize(("text", "problem"), OFFENDERS.values(), ids=OFFENDERS)
def test_rule_fires_with_file_and_line(text: str, problem: str) -> None:
    module = "" if text == "x = 1" else '"""Words."""\n'
    (page,) = pages({"plant/a.py": module + text})
    (offence,) = documentation_offences(page)
    assert re.match(r"plant/a\.py:\d+: ", offence)
    assert problem in offence


@pytest.mark.parametrize(
    ("signature", "entry", "description", "problem"),
    [
        ("x: float", "x : float", "The pressure.", "gives no [unit] of 'x'"),
        ("x: float", "x : float", "In [0, 1], the index [i].", "gives no [unit] of 'x'"),
        ("x: 'float | None' = None", "x : float, optional", "The pressure.", "gives no [unit] of 'x'"),
        ("x: Speed", "x : float", "The speed.", "gives no [unit] of 'x'"),
        ("x: NDArray[np.float64]", "x : ndarray", "Pressure [Pa], any shape.", "gives no shape of 'x'"),
        ("x: Sequence[Track]", "x : sequence of ndarray", "Tracks [m].", "gives no shape of 'x'"),
        ("x: float", "x : float", "The pressure [Pa].", None),
        ("x: float", "x : float", "Leakage [m^3/(s Pa)].", None),
        ("x: float", "x : float", "Damping, dimensionless.", None),
        ("x: float", "x : float", "Noise [the state's unit squared].", None),
        ("x: float, y: float", "x, y : float", "Position [m].", None),
        ("x: Scalar", "x : bool or Expression", "A comparison.", None),
        ("speed_rad_s: float", "speed_rad_s : float", "Speed.", None),
        ("speed_s_bars: float", "speed_s_bars : float", "Speed.", "gives no [unit] of 'speed_s_bars'"),
        ("x: NDArray[np.float64]", "x : ndarray, shape (n,)", "Pressure.", None),
        ("x: Callable[[float], float]", "x : callable", "A function of time.", None),
        ("*x: float, **y: float", "*x, **y : float", "Times [s].", None),
    ],
)
def test_numbers_must_have_a_unit_or_shape(signature: str, entry: str, description: str, problem: str | None) -> None:
    aliases = '"""A."""\nSpeed: TypeAlias = float | int\nTrack = NDArray[np.float64]\n'
    function = DESCRIBED.format(signature=signature, entry=entry, description=description)
    (page,) = pages({"plant/a.py": aliases + function})
    offences = list(documentation_offences(page))
    assert len(offences) == (problem is not None)
    assert all(str(problem) in offence for offence in offences)


@pytest.mark.parametrize(
    "text",
    [
        "def _f(x): ...",
        "class _A:\n    def f(self, x): ...",
        'class A(Protocol):\n    """A."""\n    def f(self, x: float):\n        """Do it."""\n        ...',
        'class _A:\n  def f(self, x: float): ...\nclass B(_A):\n  """B."""\n  def f(self, x: float):\n    """F."""',
        '@app.command()\ndef f(x: float):\n    """Do it."""',
        '@dataclass\nclass A:\n    """A."""\n    x: Annotated[float, SI("m", "length", "Table 1")]',
        'class A:\n    """A."""\n    @property\n    def f(self) -> float:\n        """F.\n\n        More."""',
        'def f(x: int) -> str:\n    """F.\n\n    More."""',
    ],
)
def test_rules_leave_the_exempt_alone(text: str) -> None:
    (page,) = pages({"experiments/cli.py": '"""A."""\n' + text})
    assert list(documentation_offences(page)) == []


def test_private_modules_are_not_walked() -> None:
    walked = pages({"plant/_a.py": "", "plant/_b/c.py": "", "plant/__init__.py": "", "plant/d_e.py": ""})
    assert [page.path for page in walked] == ["plant/__init__.py", "plant/d_e.py"]


def test_the_public_api_is_documented() -> None:
    walked = _read()
    assert {"plant/units.py", "plant/log/record.py"} <= {page.path for page in walked}
    offences = [offence for page in walked for offence in documentation_offences(page)]
    assert not offences, "\n".join(offences)
