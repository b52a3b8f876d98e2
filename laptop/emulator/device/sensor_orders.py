"""Orders such as `--plug in2=ultrasonic:12..80/5s,heard=0:1@3`: a sensor and its values."""

import re
from functools import partial
from typing import Dict, Iterable, NamedTuple, Union

from laptop.emulator.constants import ConstantTable, Owners, Wording
from laptop.emulator.device.buttons import INPUTS
from laptop.emulator.device.sensor_kinds import BY_CHANNEL, CHANNELS, KINDS
from laptop.emulator.device.sensor_values import Signal, columns, is_file, read_column, read_signal
from shared.arm_description import ArmError
from shared.message_fields import one_line

MYPY = False
if MYPY:
    from typing import List, Optional, Tuple  # noqa: F401

    from laptop.emulator.device.sensor_values import Value  # noqa: F401

    Quantities = Dict[str, Union[Signal, str]]  # a word names a quantity of the environment


NONE = "none"
"""Kind of an input where nothing is plugged in."""

TOUCH_KINDS = ("touch", "nxt-touch")
"""Kinds of sensors that a hand can press."""

SensorOrder = NamedTuple(
    "SensorOrder",
    [
        ("port", str),
        ("kind", str),
        ("quantities", Dict[str, Union[Signal, str]]),
        ("text", str),
    ],
)
SensorOrder.__doc__ = """A sensor to be plugged in.

port        "in1" to "in4"
kind        a key of KINDS, or NONE
quantities  key (of an infrared sensor's channels with its number and a dot before it) -> Signal, or
            a word of the kind's environment
text        as it was written
"""

_CONSTANT = ("x", "y", "z", "noise", "flipped")
"""Quantities that do not change."""


class BadSensor(ArmError, ValueError):
    """A sensor, or a value of it, that cannot be understood."""


def read_sensor(text: str) -> SensorOrder:
    """Read a SensorOrder from `PORT=KIND[:VALUES][,KEY=VALUES...]`; see `sensor_values` for VALUES.

    Raises:
        BadSensor: in one line, with the next step.
    """
    match = re.match(r"^(in[1-4])=([a-z-]+)(?:$|(?=[:,]))(:?)(.*)$", text, re.DOTALL)
    if not match or match.group(2) not in set(KINDS) | {NONE}:
        raise BadSensor(
            "sensor '{}': write PORT=KIND or PORT=KIND:VALUES with a port from in1 to in4 and one "
            "of {}".format(one_line(text), ", ".join(sorted(KINDS) + [NONE]))
        )
    port, kind, colon, rest = match.groups()
    if kind == NONE and rest:
        raise BadSensor("sensor '{}': none takes no values".format(one_line(text)))
    if kind == NONE:
        return SensorOrder(port, kind, {}, text)
    return SensorOrder(port, kind, _quantities(kind, rest, bool(colon)), text)


def _quantities(name: str, text: str, has_main: bool) -> "Quantities":
    kind = KINDS[name]
    main, _, rest = text.partition(",") if has_main else ("", "", text)
    if has_main and not main:
        raise BadSensor("sensor {}: no value behind the colon".format(name))
    key, equals, _ = main.partition("=")
    if equals and (key.rpartition(".")[2] in kind.quantities or not is_file(main)):
        main, rest = "", text  # KEY=VALUES at once
    table = _table(name)
    if is_file(main):
        given = _of_file(name, table, main)
    elif main:
        written = kind.main[0] if main[0].isalpha() else kind.main[-1]
        written = next((key for key, names in kind.environment.items() if main in names), written)
        given = {_channelled(written, ""): table.parse("{}={}".format(written, main))[""][written]}
    else:
        given = {}
    for owner, values in table.parse(rest).items():
        for key, signal in values.items():
            if _channelled(key, owner) in given:
                raise BadSensor("sensor {}: {} is given twice; give it once".format(name, key))
            given[_channelled(key, owner)] = signal
    if len(kind.main) > 1 and given.keys() >= set(kind.main):
        raise BadSensor(
            "sensor {}: {} each say all of it; give one of them".format(
                name, " and ".join(kind.main)
            )
        )
    return given


def _channelled(key: str, owner: str) -> str:
    """Return the key of a quantity; of one that every channel has, with the channel's number."""
    return "{}.{}".format(owner or CHANNELS[0], key) if key in BY_CHANNEL else key


def _table(name: str) -> ConstantTable:
    """Return the grammar of one kind's quantities."""
    kind = KINDS[name]
    noun = "sensor " + name
    channels = CHANNELS if name == "infrared" else ()

    def read(key: str, text: str, written: str) -> Union[Signal, str]:
        if text in kind.environment.get(key, ()):
            return text

        def error(message: str) -> BadSensor:
            return BadSensor("{} {} = {}".format(noun, written, message))

        def value(part: str) -> "Value":
            return table.check(key, part, written)

        signal = read_signal(text, value, kind.quantities[key].kind is not float, error)
        if key in _CONSTANT and ("@" in text or ".." in text or is_file(text)):
            raise error("'{}': it does not change; write one number".format(text))
        return signal

    table = ConstantTable(
        noun,
        kind.quantities,
        BadSensor,
        Wording(noun + ": no quantity '{key}' in '{item}'; known: {known}", "VALUES"),
        owners=Owners(channels, [key for key in kind.quantities if key not in BY_CHANNEL]),
        reader=read,
    )
    return table


def _of_file(name: str, table: ConstantTable, file: str) -> "Quantities":
    """Return the quantities in a file: by the names of its columns, or else the main one."""
    kind = KINDS[name]

    def error(message: str) -> BadSensor:
        return BadSensor("sensor {}: {}".format(name, message))

    named = [key for key in columns(file, error) if key in kind.quantities]
    # Quantities and the columns that give them; None: the only one.
    pairs = [(key, key) for key in named]  # type: List[Tuple[str, Optional[str]]]
    pairs = pairs or [(kind.main[-1], None)]
    return {
        _channelled(key, ""): read_column(
            file,
            column,
            partial(table.check, key),
            kind.quantities[key].kind is not float,
            error,
        )
        for key, column in pairs
    }


def listing() -> str:
    """Return the kinds and their quantities for `--help`, on one line."""
    return "; ".join(
        "{} ({})".format(name, ", ".join(KINDS[name].quantities)) for name in sorted(KINDS)
    )


def read_sensors(texts: Iterable[str]) -> Dict[str, SensorOrder]:
    """Read all SensorOrders, at most one for an input; an input without one has a touch sensor.

    Returns:
        port -> SensorOrder.

    Raises:
        BadSensor
    """
    orders = {}  # type: Dict[str, SensorOrder]
    for text in texts:
        order = read_sensor(text)
        if order.port in orders:
            raise BadSensor(
                "sensor '{}': {} has one already, '{}'; choose another input".format(
                    one_line(text), order.port, one_line(orders[order.port].text)
                )
            )
        orders[order.port] = order
    for port in INPUTS:
        orders.setdefault(port, SensorOrder(port, "touch", {}, port + "=touch"))
    return orders
