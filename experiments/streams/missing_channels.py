"""Channels of a stream that have no samples for long: nothing is judged meanwhile, and no balance would say so."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

LONGEST_SILENCE = 10.0
"""Time in which no group of a channel's samples is whole, before it is reported [s]: longer than an end of a radio link
or a restarted logger; judged."""


@dataclass
class MissingChannels:
    """Tells which channels have ceased, and which are back.

    Parameters
    ----------
    whole : dict[str, float]
        End of each channel's last group without a missing sample [s].
    ceased : set of str
        Channels that were reported.
    """

    whole: dict[str, float] = field(default_factory=dict)
    ceased: set[str] = field(default_factory=set)

    def process(
        self, channels: "Mapping[str, NDArray[np.float64]]", last: float, gap: bool = False
    ) -> list[tuple[str, float, bool]]:
        """Process a group of samples; return what is new.

        Parameters
        ----------
        channels : Mapping[str, ndarray], shape (n,) each
            Samples by channel; NaN if missing [SI].
        last : float
            Time of the last sample [s].
        gap : bool
            Whether rows are missing before the samples: the time between is no channel's fault.

        Returns
        -------
        list of tuple
            Channel, end of its last whole group [s], and whether it is missing; else it is back.
        """
        import numpy as np

        news = []
        for name, values in channels.items():
            since = last if gap and name not in self.ceased else self.whole.setdefault(name, last)
            if len(values) and np.isfinite(values).all():
                if name in self.ceased:
                    self.ceased.remove(name)
                    news.append((name, since, False))
                self.whole[name] = last
            elif name not in self.ceased and last - since > LONGEST_SILENCE:
                self.ceased.add(name)
                news.append((name, since, True))
            elif gap:
                self.whole[name] = since
        return news
