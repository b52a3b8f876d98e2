"""The grammar of KEY=VALUE, on a table of its own."""

from collections import OrderedDict

import pytest

from laptop.emulator.constants import Constant, ConstantTable, Owners, Wording


class BadLamp(ValueError):
    """A constant of the lamp is wrong."""


LAMP = ConstantTable(
    "lamp",
    OrderedDict(
        [
            ("power", Constant(5.0, (0.5, 10.0), "W", "of the bulb")),
            ("bulbs", Constant(None, (1, 4), "", "in it", int)),
            ("colour", Constant("warm", ("warm", "cold"), "", "of the light", str)),
        ]
    ),
    BadLamp,
    Wording("lamp: no '{key}' in '{item}'; known: {known}"),
    ranged={"power"},
    owners=Owners("AB", ("colour",)),
)


def test_values_are_of_all_or_of_one_owner():
    given = LAMP.parse(" power = 2 , A.bulbs=3,B.power=1..2,,colour=cold")
    assert given == {
        "": {"power": [2.0], "colour": ["cold"]},
        "A": {"bulbs": [3]},
        "B": {"power": [1.0, 2.0]},
    }
    assert isinstance(given["A"]["bulbs"][0], int)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("volts=3", "lamp: no 'volts' in 'volts=3'; known: power, bulbs, colour"),
        ("power", "lamp 'power': write power=VALUE"),
        ("power=11", "lamp power = 11: must be a number from 0.5 to 10 W (of the bulb)"),
        ("A.bulbs=1.5", "lamp A.bulbs = 1.5: must be a whole number from 1 to 4 (in it)"),
        ("colour=red", "lamp colour = red: must be one of warm, cold"),
        ("bulbs=1..2", "lamp bulbs: '1..2' is not a single value"),
        ("power=1..2..3", "lamp power: '1..2..3' is not a single value or LOW..HIGH"),
        ("C.power=1", "lamp 'C.power': no lamp 'C'; known: A, B"),
        (".power=1", "lamp '.power': no lamp ''; known: A, B"),
        ("A.colour=cold", "lamp 'A.colour': all lamps see the same colour; write colour=VALUE"),
    ],
)
def test_what_is_not_allowed_is_refused_in_one_line(text, message):
    with pytest.raises(BadLamp) as refused:
        LAMP.parse(text)
    assert str(refused.value) == message


def test_the_listing_has_every_constant_with_default_unit_and_meaning():
    assert LAMP.listing() == (
        "power (5.0 W): of the bulb; bulbs (not given): in it; colour (warm): of the light"
    )
