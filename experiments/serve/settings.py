"""Settings of a server: its folder, its access control, and its limits."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from ipaddress import ip_address
from pathlib import Path
from urllib.parse import urlsplit

from plant.errors import HydrostateError

VERBS = ("diagnose", "estimate", "inspect")
"""Verbs that the server can run on a log."""

LEAST_TOKEN = 16
"""Smallest length of a token [characters]."""

MB = 1 << 20

PORT = 8765


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Settings of a server.

    Parameters
    ----------
    folder : Path
        Folder for everything that the server stores.
    host, port : str, int
        Address on which it listens.
    token : str or None
        Token that a client must present; None only if no other machine can connect.
    url : str or None
        Address at which browsers reach the server, if a proxy is in front.
    plant, rig, columns : str or None, Path or None, Mapping[str, str]
        Actuator of the logs, as on the command line.
    rigs : Path or None
        Folder of rig files, each named after the actuator whose logs it applies to; ``rig`` is then for all other logs.
    pattern : str or None
        Pattern of log names, as in `experiments.fleet.naming.by_pattern`.
    limits : Mapping[str, float]
        Limits of severities [their units].
    maintenance : Path or None
        Table of repairs, as in `experiments.fleet.outlook.read_maintenance`; it is read for each page.
    workers : int
        Logs processed in parallel [count].
    seconds : float
        Longest processing time for a log [s].
    memory : int
        Largest memory of a process that works on a log [bytes].
    largest : int
        Largest log that is accepted [bytes].
    room : int
        Largest total size of the folder's logs and pages [bytes].
    waiting : int
        Largest number of waiting logs [count].
    streams : Mapping[str, str]
        Address of each watched stream, by its name.
    false_alarms : float
        Rate for each stream, during healthy, moving operation [1/h].

    Raises
    ------
    HydrostateError
        If a required token is missing or too short, or the address is not one.
    """

    folder: Path
    host: str = "127.0.0.1"
    port: int = PORT
    token: str | None = None
    url: str | None = None
    plant: str | None = None
    rig: Path | None = None
    rigs: Path | None = None
    columns: Mapping[str, str] = field(default_factory=dict[str, str])
    pattern: str | None = None
    limits: Mapping[str, float] = field(default_factory=dict[str, float])
    maintenance: Path | None = None
    workers: int = 1
    seconds: float = 300.0
    memory: int = 3072 * MB
    largest: int = 256 * MB
    room: int = 10240 * MB
    waiting: int = 200
    streams: Mapping[str, str] = field(default_factory=dict[str, str])
    false_alarms: float = 1.0

    def __post_init__(self) -> None:
        if self.token is None and not (is_loopback(self.host) and self.url is None):
            where = f"--host {self.host}" if self.url is None else f"--url {self.url}"
            raise HydrostateError(f"{where} can be reached from other machines, so a token is needed")
        if self.token is not None and not _is_usable(self.token):
            raise HydrostateError(
                f"a token must have at least {LEAST_TOKEN} ASCII letters, digits or signs, and neither begin nor end "
                "with a blank"
            )
        if self.url is not None and not _is_address(self.url):
            raise HydrostateError(f"--url must be http://HOST/ or https://HOST/PATH/, got {self.url!r}")

    @property
    def logs(self) -> Path:
        """Folder of the logs as received."""
        return self.folder / "logs"

    @property
    def pages(self) -> Path:
        """Folder of the pages of logs."""
        return self.folder / "pages"

    @property
    def work(self) -> Path:
        """Folder for work in progress; it is emptied at the start."""
        return self.folder / "work"

    @property
    def database(self) -> Path:
        """Database file with the state and results of the logs."""
        return self.folder / "hydrostate.sqlite"


def _is_usable(token: str) -> bool:
    return len(token) >= LEAST_TOKEN and token.isascii() and token.isprintable() and token == token.strip()


def _is_address(url: str) -> bool:
    try:
        parts = urlsplit(url)
        return parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0 and not parts.query
    except ValueError:
        return False


def is_loopback(host: str) -> bool:
    """Return whether a host name or address accepts connections only from this machine.

    Examples
    --------
    >>> is_loopback("127.0.0.1"), is_loopback("localhost"), is_loopback("0.0.0.0")
    (True, True, False)
    """
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False
