"""Runs one mutated input under a time limit, and returns what is wrong with the outcome."""

import signal
import warnings
from collections.abc import Callable
from typing import NoReturn

from plant.errors import HydrostateError

LONGEST = 10.0
"""Processor time that one input may take [s]: on a busy machine, elapsed time would report false hangs."""


class HangError(BaseException):
    """The input took too long."""


def _hang(*_: object) -> NoReturn:
    raise HangError


def limited(use: Callable[[], object]) -> str:
    """Use an input; return what is wrong, or an empty string if it is accepted or refused in one sentence."""
    before = signal.signal(signal.SIGPROF, _hang)
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            use()
    except HydrostateError as error:
        said = str(error)
        if "\x1b" in said or len(said) > 2500 or "an internal error" in said:
            return f"a sentence of {len(said)} characters: {said[:200]!r}"
    except HangError:
        return f"over {LONGEST:g} s"
    except Exception as error:
        return f"{type(error).__name__}: {str(error)[:300]}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
    return ""
