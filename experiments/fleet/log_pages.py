"""Pages of the sickest actuators of a fleet and of their logs, with file names that do not reveal folders."""

import re
from collections.abc import Callable, Iterable
from hashlib import sha256
from pathlib import Path

from experiments.command.json_output import write_whole
from experiments.fleet.actuator_page import actuator_page
from experiments.fleet.actuators import ActuatorRow


def file_name(name: str) -> str:
    """Return the file name for the page of an actuator or a log.

    Parameters
    ----------
    name : str
        Name of the actuator, or path of the log.

    Returns
    -------
    str
        Safe on every system, and unique for each name.

    Examples
    --------
    >>> file_name("hall 3/P-12.csv")
    'P-12.csv-2a1d83a787f9.html'
    """
    plain = re.sub(r"[^A-Za-z0-9._-]+", "_", name.rsplit("/", 1)[-1])[:60].strip(".") or "log"
    return f"{plain}-{sha256(name.encode()).hexdigest()[:12]}.html"


def write_pages(
    rows: Iterable[ActuatorRow], out: Path, most: int, write: Callable[[str, Path], bool]
) -> dict[str, str]:
    """Write the page of the last log of the sickest actuators, and a trend page for those with several logs.

    Parameters
    ----------
    rows : iterable of ActuatorRow
        The sickest first.
    out : Path
        Folder of the fleet's page.
    most : int
        Largest number of pages [count].
    write : callable
        ``write(file, path)`` writes the page of a log, and returns whether the log could be read.

    Returns
    -------
    dict[str, str]
        Path relative to the fleet's page, by actuator.
    """
    links: dict[str, str] = {}
    for row in list(rows)[:most]:
        place = Path("pages") / file_name(row.last.file)
        written = row.last.state != "failed" and write(row.last.file, out / place)
        if written:
            links[row.name] = place.as_posix()
        if len(row.logs) > 1:
            course = Path("actuators") / file_name(row.name)
            page = actuator_page(row, {row.last.file: f"../{place.as_posix()}"} if written else {})
            write_whole(out / course, page, "--out", parents=True)
            links[row.name] = course.as_posix()
    return links
