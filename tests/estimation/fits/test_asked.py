"""What a log is asked beside the plain form."""

from dataclasses import replace

from estimation.fits.asked import asked_of
from estimation.fits.hypotheses import HYPOTHESES
from estimation.fits.left_open import OPEN_DELIVERY
from estimation.fits.objections import DOUBTED, LARGEST_CHI_SQUARE
from estimation.fits.promises import Promise
from estimation.notes import RigCode
from tests.estimation.fits.short_logs import PAPER, log, made_fit, seen
from tests.estimation.fits.test_numbers_wide import all_promise


def test_a_fit_that_leaves_more_than_the_noise_of_sensors_is_asked_for_all_that_may_be_strange() -> None:
    """The gate lets it pass: bulk modulus of a single rod was 39 % too low behind it."""
    plain, sound = seen(log(6.0)), made_fit(400.0, 2e8, 1e5)
    doubted = replace(sound, chi_square=(0.5 * (DOUBTED + LARGEST_CHI_SQUARE),))
    with all_promise(Promise(0.0, 0.0, 2.0 * OPEN_DELIVERY)):
        asked, remarks = asked_of(plain, PAPER, doubted, doubted, loaded=False, moving=False)
        assert asked == HYPOTHESES
        assert [note.code for note in remarks] == [RigCode.WEAR_NOT_EXCLUDED]  # what is left open stays so
        assert asked_of(plain, PAPER, sound, sound, loaded=False, moving=False) == ((), remarks)


def test_a_short_log_is_not_asked_for_all_where_noise_alone_leaves_as_much_by_chance() -> None:
    """One plain log of 2 s in eleven was: it took four times as long, and nothing was ever found."""
    short, sound = seen(log(2.0)), made_fit(400.0, 2e8, 1e5)
    with all_promise(Promise(0.0, 0.0, 2.0 * OPEN_DELIVERY)):
        for chi_square, wanted in ((1.16, ()), (1.18, HYPOTHESES)):
            fit = replace(sound, chi_square=(chi_square,))
            assert asked_of(short, PAPER, fit, fit, loaded=False, moving=False)[0] == wanted
