"""The card of figures."""

import pytest

from laptop.page.cards import state as card


@pytest.mark.parametrize(
    ("volts", "says", "warns"),
    [
        (7.44, "7.4 V", False),
        (6.2, "6.2 V: low, charge it or put in fresh cells", True),
        (None, None, None),
    ],
)
def test_the_battery_is_shown_if_the_brick_tells_with_a_warning_if_it_is_low(
    scene, volts, says, warns
):

    def battery():
        facts = card.facts_of(scene.controller.state())
        return [(fact.text, fact.warns) for fact in facts if fact.name == "battery"]

    scene.server.tell("ready", 0, battery=volts)
    assert battery() == ([] if volts is None else [(says, warns)])
    scene.server.there = False
    assert battery() == [], "of a brick that has gone"


def test_a_marker_is_told_in_words_and_in_the_field_s_terms(scene):
    facts = {fact.name: fact for fact in card.facts_of(scene.controller.state())}
    assert facts["tip's marker"].text == "red disc"
    assert facts["tip's marker"].explanation.startswith("effector: disc, hue 0 +- 20, ")
