"""Cases of a study: a series, simulated or logged, and the method applied to it."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, TypeAlias

from plant.log.files import sidecar

BYTES_A_SAMPLE = 50
"""About how much of a log's file a sample takes [byte]."""


@dataclass(frozen=True)
class Simulated:
    """A series that is simulated.

    Parameters
    ----------
    plant, drive, sensors : str
        Names, as `hydrostate simulate` knows them.
    condition : str or None
        The condition; None where severities are free.
    leakage_severity, friction_severity : float
        Severities [dimensionless].
    seed : int
        Seed of the drive and of the sensors' noise.
    duration_s, sample_time_s : float
        Length and time between samples [s].
    """

    plant: str
    drive: str
    sensors: str
    condition: str | None
    leakage_severity: float
    friction_severity: float
    seed: int
    duration_s: float
    sample_time_s: float

    @property
    def samples(self) -> int:
        """Count of samples."""
        return round(self.duration_s / self.sample_time_s)


@dataclass(frozen=True)
class Log:
    """A series that is a log.

    Parameters
    ----------
    content : str
        Hash of its bytes, see `content_of`.
    size : int
        Its length [byte].
    sample_time_s : float or None
        Time between rows [s] where times do not tell it.
    folder : str
        The folder whose rig file is the log's, as the study names it; empty for the study's own rig file.
    """

    file: str
    path: str
    content: str
    size: int
    columns: tuple[tuple[str, str], ...]
    sample_time_s: float | None = None
    folder: str = ""

    @property
    def samples(self) -> int:
        """About how many samples it holds."""
        return max(self.size // BYTES_A_SAMPLE, 1)


Series: TypeAlias = Simulated | Log


@dataclass(frozen=True)
class Work:
    """One analysis of a series.

    Parameters
    ----------
    verb, form, method : str
        As in `experiments.batch.study_file.Method`.
    start_pa : float or None
        First guess of bulk modulus [Pa]; None for the rig's own, or where there is none to make.
    start_std_pa : float
        Its standard deviation [Pa].
    """

    verb: str
    form: str
    method: str
    pressure: bool
    told: str
    start_pa: float | None
    start_std_pa: float


class Group(NamedTuple):
    """The cases of one series.

    Parameters
    ----------
    keys : tuple of str
        The key of each case.
    works : tuple of Work
        What is done in each.
    """

    series: Series
    keys: tuple[str, ...]
    works: tuple[Work, ...]


def content_of(path: Path) -> str:
    """Return a hash of a log's bytes, and of the notes that stand beside a CSV.

    Returns
    -------
    str
        32 hexadecimal digits; empty where it cannot be read, which becomes a failed case and not the end of a study.
    """
    digest = hashlib.sha256()
    try:
        for part in (path, sidecar(path)):
            if part == path or part.is_file():
                with part.open("rb") as file:
                    digest.update(hashlib.file_digest(file, "sha256").digest())
    except OSError:
        return ""
    return digest.hexdigest()[:32]
