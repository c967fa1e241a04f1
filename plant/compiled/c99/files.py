"""Files of exported C: a header, a source, an example and a Makefile, from templates whose names are filled in."""

import re
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

from plant.compiled.c99.precision import Precision
from plant.errors import HydrostateError

_NAME = re.compile(r"[a-z][a-z0-9_]{0,30}")
_KEYWORD = re.compile(
    "auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|main|"
    "register|restrict|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while"
)


def checked_name(name: str) -> str:
    """Return a name if it is valid in C for types, functions and files.

    Parameters
    ----------
    name : str
        Lower-case letters, digits and underscores, a letter first, 31 characters at most.

    Raises
    ------
    HydrostateError
        If it is not valid.

    Examples
    --------
    >>> checked_name("pressure_ekf")
    'pressure_ekf'
    """
    if not _NAME.fullmatch(name) or _KEYWORD.fullmatch(name):
        raise HydrostateError(
            "a name in C must be lower-case letters, digits and _, begin with a letter, be no word of C and have at "
            f"most 31 characters, got {name!r}"
        )
    return name


def c_files(package: str, kind: str, name: str, real: Precision, facts: Mapping[str, Any]) -> dict[str, str]:
    """Fill in the templates of exported C.

    Parameters
    ----------
    package : str
        Package whose ``export/templates`` holds the templates ``KIND.h``, ``KIND.c`` and ``KIND_example.c``.
    kind : str
        The kind of export.
    name : str
        Name of its files, types and functions.
    facts : Mapping[str, Any]
        Values for the templates, by name, besides name, version, and the spelling of numbers.
    """
    templates = {
        f"{name}.h": f"own/{kind}.h",
        f"{name}.c": f"own/{kind}.c",
        "example.c": f"own/{kind}_example.c",
        "Makefile": "shared/Makefile",
    }
    called = {"name": name, "NAME": name.upper(), "version": version("hydrostate")}
    spelt = {"real": real.name, "f": real.function_suffix, "lit": real.literal, "digits": real.digits}
    whole = {**called, **spelt, **facts}
    return {file: _render(package, "export/templates", template, whole) for file, template in templates.items()}


def fill_template(package: str, folder: str, template: str, facts: Mapping[str, Any]) -> str:
    """Fill in one template.

    Parameters
    ----------
    package, folder, template : str
        Location of the template.
    facts : Mapping[str, Any]
        Values for the template, by name.
    """
    return _render(package, folder, f"own/{template}", facts)


def _render(package: str, folder: str, template: str, facts: Mapping[str, Any]) -> str:
    from jinja2 import Environment, PackageLoader, PrefixLoader, StrictUndefined

    own, shared = PackageLoader(package, folder), PackageLoader("plant", "compiled/c99/templates")
    environment = Environment(  # noqa: S701  C is no HTML
        loader=PrefixLoader({"own": own, "shared": shared}),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(template).render(**facts)
