"""Somebody between laptop and brick on real TCP: nothing of his is taken, and he is noticed."""

import man_in_the_middle
import pytest


@pytest.mark.long
def test_nothing_is_taken_from_one_in_between_and_both_sides_notice():
    kinds = man_in_the_middle.ATTACKS
    results = list(man_in_the_middle.attacks(6 * len(kinds)))
    assert [result for result in results if result.taken] == []
    # A computer that is busy for seconds ends a connection by silence before the attack comes.
    struck = [result for result in results if "nothing heard" not in result.brick]
    assert len(struck) > len(results) / 2
    assert [result for result in struck if result.seconds > man_in_the_middle.LIMIT] == []
    changed = ("a message was changed or repeated on the way",)
    cut = ("closed the connection", "Connection reset by peer", "Broken pipe")  # as it comes
    for result in struck:
        # Who finds it out says so; the farewell may come too late where the computer is busy.
        said = [result.brick, result.laptop]
        if not result.kind.startswith("cut"):
            assert any(text in line for text in changed for line in said), result
        assert all(any(text in line for text in changed + cut) for line in said), result
