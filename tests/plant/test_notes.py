"""Notes that say the same are told once."""

from plant.log.notes import LogCode
from plant.notes import distinct


def test_a_note_is_kept_once_where_it_came_first() -> None:
    one, other = LogCode.CLOCK_ASSUMED.note(sample_time_s=1.0), LogCode.CLOCK_ASSUMED.note(sample_time_s=2.0)
    assert distinct([one, other, LogCode.CLOCK_ASSUMED.note(sample_time_s=1.0)]) == (one, other)
    assert distinct([]) == ()
