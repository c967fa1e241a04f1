"""Size of a nine-condition study."""

from dataclasses import dataclass


@dataclass(frozen=True)
class StudySettings:
    """Size and seed of a nine-condition study.

    Parameters
    ----------
    starts : tuple of float
        First guesses of effective bulk modulus [Pa], as in Figure 11.
    duration : float
        Duration of the estimation and validation runs [s].
    sample_time : float
        Sample time of these runs, from section 7 [s].
    identification_duration : float
        Duration of the identification runs [s].
    classification_sample_time : float
        Sample time of the classification runs [s].
    filterpy_samples : int
        Number of samples of each log that filterpy's filter also processes, about 0.1 ms each [count].
    """

    seed: int = 2024
    starts: tuple[float, ...] = (0.0, 0.5e8, 1e8, 2e8, 3e8, 4e8, 5e8)
    duration: float = 10.0
    sample_time: float = 1e-4
    identification_duration: float = 20.0
    seeds: int = 20
    classification_sample_time: float = 1e-3
    filterpy_samples: int = 5000


def quick_settings(seed: int) -> StudySettings:
    """Return a small study: the same nine conditions and parts, fewer first guesses and seeds, shorter runs."""
    return StudySettings(
        seed=seed, starts=(0.0, 5e8), duration=4.0, identification_duration=8.0, seeds=2, filterpy_samples=500
    )
