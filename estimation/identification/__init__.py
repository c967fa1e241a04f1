"""System identification: from input and output samples to a transfer function that says how sure it is.

The names in `face` are at hand here too; its modules are imported when one of them is asked for.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from estimation.identification.face import *  # noqa: F403  type checkers see the names that __getattr__ gives


def __getattr__(name: str) -> Any:
    import estimation.identification.face as face

    try:
        return getattr(face, name)
    except AttributeError:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}") from None
