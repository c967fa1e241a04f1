"""A hint names causes in a reader's words."""

from estimation.fits.cause_words import CAUSE_WORDS
from estimation.fits.hypotheses import HYPOTHESES, MAKEUP_BENDS, PRESSURE_SIDES
from estimation.notes import RigCode


def test_every_hypothesis_has_words_for_a_reader() -> None:
    asked = {one.name for one in HYPOTHESES} | {MAKEUP_BENDS.name, PRESSURE_SIDES.name}
    assert asked == CAUSE_WORDS.keys()
    assert not any("_" in words for words in CAUSE_WORDS.values())


def test_a_hint_is_a_sentence_without_names_of_the_code() -> None:
    note = RigCode.PARTLY_EXPLAINED.note(cause="delivery", causes=CAUSE_WORDS["delivery"], left=4.0, explained=96.0)
    assert str(note) == (
        "a hint only: a pump that delivers less than its displacement would explain 96 % of what the flow balance does "
        "not"
    )
