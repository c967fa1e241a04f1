"""Pages of the sickest logs of a fleet, under names that hold no folder."""

import re
from collections.abc import Callable, Iterable
from hashlib import sha256
from pathlib import Path

from experiments.fleet.actuators import ActuatorRow


def file_name(name: str) -> str:
    """Return the name of the page of an actuator or a log.

    Parameters
    ----------
    name : str
        Of the actuator, or the path of the log.

    Returns
    -------
    str
        Safe on every system, and different for different names.

    Examples
    --------
    >>> file_name("hall 3/P-12.csv")
    'P-12.csv-2a1d83.html'
    """
    plain = re.sub(r"[^A-Za-z0-9._-]+", "_", name.rsplit("/", 1)[-1])[:60].strip(".") or "log"
    return f"{plain}-{sha256(name.encode()).hexdigest()[:6]}.html"


def write_pages(
    rows: Iterable[ActuatorRow], out: Path, most: int, write: Callable[[str, Path], bool]
) -> dict[str, str]:
    """Write the page of the last log of the sickest actuators.

    Parameters
    ----------
    rows : iterable of ActuatorRow
        The sickest first.
    out : Path
        Folder of the fleet's page.
    most : int
        Pages at most [count].
    write : callable
        ``write(file, path)`` writes the page of a log, and returns whether the log was there to be read.

    Returns
    -------
    dict[str, str]
        Path from the fleet's page, by actuator.
    """
    links: dict[str, str] = {}
    for row in list(rows)[:most]:
        if row.last.state == "failed":
            continue
        place = Path("pages") / file_name(row.last.file)
        if write(row.last.file, out / place):
            links[row.name] = place.as_posix()
    return links
