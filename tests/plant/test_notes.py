"""Notes that state the same thing are given once."""

from plant.log.notes import LogCode
from plant.notes import Code, distinct


def test_distinct_keeps_each_note_once_at_its_first_place() -> None:
    one, other = LogCode.CLOCK_ASSUMED.note(sample_time_s=1.0), LogCode.CLOCK_ASSUMED.note(sample_time_s=2.0)
    assert distinct([one, other, LogCode.CLOCK_ASSUMED.note(sample_time_s=1.0)]) == (one, other)
    assert distinct([]) == ()


def test_a_sentence_uses_powers_of_ten_only_for_very_small_and_very_large_numbers() -> None:
    class Size(Code):
        SHARE = "missing in {percent:.2g} %, {factor:.3g} times too large, {tiny:.2g} m, {huge:.2g} Pa"

    said = str(Size.SHARE.note(percent=100.0, factor=123456.0, tiny=2.5e-6, huge=2e9))
    assert said == "missing in 100 %, 123000 times too large, 2.5e-06 m, 2e+09 Pa"


def test_an_unbounded_half_width_is_written_in_words() -> None:
    class Offset(Code):
        READS = "pressure reads {offset_pa:.3g|bar} ± {half_width_pa:.2g|bar} bar too much"

    said = str(Offset.READS.note(offset_pa=1e5, half_width_pa=float("inf")))
    assert said == "pressure reads 1 bar too much; the log does not tell how far off this may be"


def test_the_repr_of_a_note_contains_its_sentence() -> None:
    """A tuple of notes used to show templates with empty fields, separate from their numbers."""
    note = LogCode.CLOCK_ASSUMED.note(sample_time_s=0.5)
    assert repr((note,)) == f"(<clock_assumed: {note}>,)"
    assert "{" not in repr(note)


def test_a_note_that_lacks_its_data_still_has_a_repr() -> None:
    assert repr(LogCode.CLOCK_ASSUMED.note()) == "<clock_assumed: {}>"
