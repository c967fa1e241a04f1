"""The classifier under its public name; without scikit-learn, a class that tells how to install it."""

from typing import TYPE_CHECKING, Any

from plant.errors import HydrostateError

if TYPE_CHECKING:
    from faults.own_classes.classifier import Classifier as Classifier


class ClassifierWithoutScikitLearn:
    """Placeholder for `Classifier` if scikit-learn is not installed.

    Raises
    ------
    HydrostateError
        Whenever one is made.
    """

    def __init__(self, *_arguments: Any, **_named: Any) -> None:
        raise HydrostateError("hydrostate.Classifier needs scikit-learn: pip install 'hydrostate[learn]'")


def __getattr__(name: str) -> Any:
    """Return the classifier when it is first requested."""
    if name != "Classifier":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        from faults.own_classes.classifier import Classifier
    except ImportError as error:
        if not str(error.name).startswith("sklearn"):
            raise
        return ClassifierWithoutScikitLearn
    return Classifier
