"""Cases of a study: a series, simulated or logged, and the method applied to it."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, TypeAlias

from plant.log.files import sidecar

BYTES_A_SAMPLE = 50
"""Approximate size of one sample in a log's file [byte]."""


@dataclass(frozen=True)
class Simulated:
    """A series that is simulated.

    Parameters
    ----------
    plant, drive, sensors : str
        Names accepted by `hydrostate simulate`.
    condition : str or None
        The condition; None if the severities are given instead.
    leakage_severity, friction_severity : float
        Severities [dimensionless].
    seed : int
        Seed of the drive and of the sensor noise.
    duration_s, sample_time_s : float
        Duration and sample time [s].
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
        """Number of samples."""
        return round(self.duration_s / self.sample_time_s)


@dataclass(frozen=True)
class Log:
    """A series that is a log.

    Parameters
    ----------
    content : str
        Hash of its bytes, see `content_of`.
    size : int
        File size [byte].
    sample_time_s : float or None
        Sample time [s] if the log's times do not give it.
    folder : str
        Folder whose rig file applies to the log, named as in the study; empty for the study's own rig file.
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
        """Approximate number of samples."""
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
        First guess of bulk modulus [Pa]; None for the rig's own, or if the method needs none.
    start_std_pa : float
        Standard deviation of the first guess [Pa].
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
        The analysis of each case.
    """

    series: Series
    keys: tuple[str, ...]
    works: tuple[Work, ...]


def content_of(path: Path) -> str:
    """Return a hash of a log's bytes, and of the notes beside a CSV.

    Returns
    -------
    str
        32 hexadecimal digits; empty if the log cannot be read, so that the case fails but the study continues.
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
