"""The card of figures."""

import pytest


@pytest.mark.parametrize(
    ("volts", "says"),
    [
        (7.44, "<tr><td>battery</td><td>7.4 V</td>"),
        (6.2, '<tr class="warn"><td>battery</td><td>6.2 V: low, charge it'),
        (None, ""),
    ],
)
def test_the_battery_is_shown_if_the_brick_tells_with_a_warning_if_it_is_low(scene, volts, says):
    card = pytest.importorskip("laptop.page.cards.state")
    scene.server.tell("ready", 0, battery=volts)
    shown = card.facts_table(scene.controller.state())
    assert says in shown
    assert ("<td>battery<" in shown) == (volts is not None)
    scene.server.there = False
    shown = card.facts_table(scene.controller.state())
    assert "<td>battery<" not in shown, "of a brick that has gone"
