"""The claim of the page's faults: what is made of notes and poses, the table, and one for real."""

import pytest
from page_tracker import a_browser

from tests.claims import page_faults
from tests.claims.page_fault_kinds import FAULTS, PageNote

HELD = "stopped: 198.5 px off after 2 moves, 2.4 s (held: no page was heard for 2 s)"
ARRIVED = "converged: 0.7 px off after 4 moves, 5.4 s"
BY_NAME = {fault.name: fault for fault in FAULTS}


def note(t, says="", off=False, here=True, driver="You steer"):
    return PageNote(t, off, here and not off, says, driver)


CUT_OFF = [
    note(99.0, "On its way."),
    note(100.8, "Cut off: 1 s old.", off=True),
    note(101.8, "Cut off: 2 s old.", off=True),
    note(102.5, "", here=False),  # it is loaded anew
    note(102.75, "Stopped. / held"),
]


def judged(name, stood=(1.5, 1.6), notes=CUT_OFF, served=None, brick=HELD, mended=100.0):
    return page_faults.judge(BY_NAME[name], 100.0, mended, stood, notes, served, brick, None)


def test_a_page_that_is_cut_off_has_shown_it_and_is_back_with_a_picture():
    result = judged("page's process killed", served=101.2)
    assert result.shown == pytest.approx(0.8)
    assert result.anew == pytest.approx(1.2)
    assert result.back == pytest.approx(2.75)
    assert (result.wall, result.stands) == (1.5, 1.6)
    assert result.page == "Cut off: 1 s old.; then: Stopped. / held"
    assert result.misses == ()


def test_what_takes_longer_than_its_goal_or_never_comes_misses_it():
    late = [note(99.0), note(101.1, "Cut off", off=True), note(103.0)]
    result = judged("page's process frozen", (2.4, 2.4), late, served=115.0)
    assert result.misses == ("stands", "shown", "anew")
    result = judged("page's process frozen", (2.2, 2.2), [note(99.0)])
    assert (result.shown, result.anew, result.back) == (None, None, None)
    assert result.misses == ("shown", "anew")


def test_of_what_is_mended_the_return_counts_from_then():
    notes = [*CUT_OFF[:3], note(105.25, "Stopped.")]
    assert judged("network silent", notes=notes, mended=105.0).back == pytest.approx(0.25)


def test_a_page_that_stood_still_itself_is_back_with_the_first_that_it_shows():
    notes = [note(99.0, "On its way."), note(105.5, "Stopped.")]
    result = judged("tab's process frozen", notes=notes, mended=105.0)
    assert (result.shown, result.back) == (None, pytest.approx(0.5))


def test_what_a_page_says_is_what_it_has_settled_on_and_the_end():
    notes = [
        note(100.7, "Nothing but STOP is sent.", off=True),
        note(100.9, "Nothing is sent.", off=True),
        note(110.0, "Nothing is sent. It is old.", off=True),
    ]
    result = judged("tracker killed", notes=notes)
    assert (result.page, result.back) == ("Nothing is sent.", None)


def test_an_arm_that_came_to_stand_because_it_had_arrived_was_not_held():
    assert judged("browser closed", notes=[], brick=ARRIVED).misses == ("stands",)


def test_a_run_that_nothing_is_to_hold_arrives():
    notes = [note(99.0), note(100.25, "On its way.", driver="browser 2 steers")]
    result = judged("who watches takes over", (4.0, 4.0), notes, brick=ARRIVED)
    assert result.shown == pytest.approx(0.25)
    assert result.misses == ()
    assert judged("who watches takes over", notes=notes).misses == ("goes on",)


def test_an_arm_that_stood_at_once_has_taken_no_time():
    assert judged("tracker killed", None).stands == 0.0


def test_a_run_without_a_verdict_is_not_taken_for_one_that_arrived():
    assert judged("tracker killed", brick="link lost: held").verdict == ""
    assert judged("tracker killed", brick=ARRIVED).verdict == "converged"


def test_the_table_tells_what_each_is_to_hold_and_whether_it_does():
    goes_on = judged("who watches takes over", (4.0, 4.0), [note(101.0, driver="x")], None, ARRIVED)
    missed = judged("page's process frozen", served=117.0)
    assert page_faults.table([missed, goes_on]) == [
        (
            "page's process frozen",
            "stands 2.3, shown 1, anew 3",
            "no: anew",
            "1.60",
            "0.80",
            "17.00",
            "-",
            "Cut off: 1 s old.; then: Stopped. / held",
            HELD,
            "waits",
        ),
        ("who watches takes over", "goes on", "yes", "-", "1.00", "-", "-", "-", ARRIVED, "waits"),
    ]
    assert page_faults.summary([missed, goes_on]) == "1 of 2 faults of the page miss no goal"


def test_every_fault_has_a_name_of_its_own_and_a_goal():
    assert len(BY_NAME) == len(FAULTS)
    assert all(fault.goals for fault in FAULTS)
    assert {name for fault in FAULTS for name in fault.goals} == {
        "stands", "shown", "anew", "goes on",
    }  # fmt: skip


@pytest.mark.long
def test_a_page_that_is_killed_in_mid_motion_is_told_and_comes_back():
    with a_browser():
        pass  # skipped where there is none
    (result,) = page_faults.run([BY_NAME["page's process killed"]])
    assert result.shown is not None
    assert result.anew is not None
    assert result.back is not None
    assert result.page.startswith("Cut off: what is shown is")
    assert result.status is None
    assert result.verdict in ("stopped", "converged")
