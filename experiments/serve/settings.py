"""Settings of a server: its folder, whom it answers, and its limits."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from ipaddress import ip_address
from pathlib import Path

from plant.errors import HydrostateError

VERBS = ("diagnose", "estimate", "inspect")
"""What may be done with a log."""

LEAST_TOKEN = 16
"""Letters of a token, at least [count]."""

MB = 1 << 20

PORT = 8765


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Settings of a server.

    Parameters
    ----------
    folder : Path
        All that it keeps is in here.
    host, port : str, int
        Where it listens.
    token : str or None
        What a client must show; None only where this machine alone can connect.
    plant, rig, columns : str or None, Path or None, Mapping[str, str]
        Actuator of the logs, as the command line has it.
    rigs : Path or None
        Folder of rig files, each for the logs of the actuator that its name is; ``rig`` is then that of all others.
    pattern : str or None
        How logs are named, as `experiments.fleet.naming.by_pattern` takes it.
    limits : Mapping[str, float]
        Limits of severities [their units].
    maintenance : Path or None
        Table of repairs, as `experiments.fleet.outlook.read_maintenance` takes it; it is read for each page.
    workers : int
        Logs that are worked on at once [count].
    seconds : float
        Longest work on a log [s].
    memory : int
        Most memory of a process that works on a log [bytes].
    largest : int
        Largest log that is taken [bytes].
    room : int
        Most that the folder's logs and pages may take [bytes].
    waiting : int
        Logs that may wait to be worked on [count].
    streams : Mapping[str, str]
        Address of each stream that is watched, by its name.
    false_alarms : float
        Of each stream, of healthy, moving operation [1/h].

    Raises
    ------
    HydrostateError
        If a token is wanted and missing, or too short.
    """

    folder: Path
    host: str = "127.0.0.1"
    port: int = PORT
    token: str | None = None
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
        if self.token is None and not is_loopback(self.host):
            raise HydrostateError(f"--host {self.host} can be reached from other machines, so a token is needed")
        if self.token is not None and not (len(self.token) >= LEAST_TOKEN and self.token.isascii()):
            raise HydrostateError(f"a token must have {LEAST_TOKEN} ASCII letters or digits at least")

    @property
    def logs(self) -> Path:
        """Folder of the logs as they came."""
        return self.folder / "logs"

    @property
    def pages(self) -> Path:
        """Folder of their pages."""
        return self.folder / "pages"

    @property
    def work(self) -> Path:
        """Folder of what is under way; it is emptied at the start."""
        return self.folder / "work"

    @property
    def database(self) -> Path:
        """File of what is known of the logs."""
        return self.folder / "hydrostate.sqlite"


def is_loopback(host: str) -> bool:
    """Return whether this machine alone can connect to a host name or address.

    Examples
    --------
    >>> is_loopback("127.0.0.1"), is_loopback("localhost"), is_loopback("0.0.0.0")
    (True, True, False)
    """
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False
