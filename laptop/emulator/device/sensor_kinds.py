"""Sensors that can be plugged in: their drivers, their modes, and the quantities of each mode.

Names, decimals, units, ranges and numbers of values are those that ev3dev documents for its
drivers.  A mode measures with `m`: `m(key)` is a quantity now, `m.rate(key)` how fast it changes,
`m.turned(key)` how far it has turned since the mode was entered or the sensor reset, `m.noise()`
the sensor's noise now, `m.given(key)` whether an order gives the quantity.
"""

from typing import Any, Callable, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from laptop.emulator.constants import Constant

MYPY = False
if MYPY:
    from typing import Dict  # noqa: F401

    from laptop.emulator.device.sensors import Measuring  # noqa: F401

    Measure = Callable[[Measuring], Sequence[float]]
    Volts = Optional[Callable[[Measuring], float]]


Mode = NamedTuple(
    "Mode",
    [
        ("name", str),
        ("measure", Optional[Callable[["Measuring"], Sequence[float]]]),
        ("count", int),
        ("decimals", int),
        ("units", str),
        ("format", str),
        ("lowest", float),
        ("highest", float),
        ("single", bool),
    ],
)
Mode.__doc__ = """One mode of a sensor.

name      as it is written to `mode`
measure   m -> that many numbers, in units; None: the sensor does not come back from this mode
count     of values
decimals  digits of a value behind the point
units     "" if there are none
format    of `bin_data`
lowest, highest  value, in units
single    whether it measures only once, when the mode is written
"""

Kind = NamedTuple(
    "Kind",
    [
        ("driver", str),
        ("connection", str),
        ("quantities", Mapping[str, Constant]),
        ("main", Tuple[str, ...]),
        ("environment", Mapping[str, Tuple[str, ...]]),
        ("modes", Tuple[Mode, ...]),
        ("volts", Optional[Callable[["Measuring"], float]]),
    ],
)
Kind.__doc__ = """One kind of sensor.

driver      its name
connection  how it talks, as the port's mode has it
quantities  key -> Constant: all that it can measure, and where it is
main        keys that a text without a key may mean: the first for words, the last for numbers; each
            says all of it, so that one is given
environment key -> words, for what the emulated world itself can give
modes       Modes, the first as it is plugged in
volts       of an NXT/Analog sensor: m -> V, what the port sees; None for all others
"""

INCH = 2.54
"""Length of an inch, cm."""
CHANNELS = ("1", "2", "3", "4")
"""Channels of the infrared remote control and beacon."""
BY_CHANNEL = ("heading", "beacon", "buttons")
"""Quantities that an infrared sensor measures on each channel."""

NO_ECHO = 255.0
"""Distance that an ultrasonic sensor shows where it hears no echo, cm."""
MAX_ECHO_DISTANCE = 250.0
"""Greatest distance of an echo, cm."""

SURFACES = (
    ("none", (0, 0, 0)),
    ("black", (6, 6, 6)),
    ("blue", (8, 17, 40)),
    ("green", (10, 35, 15)),
    ("yellow", (75, 60, 12)),
    ("red", (65, 10, 8)),
    ("white", (85, 85, 85)),
    ("brown", (25, 14, 8)),
)
"""Names in the order of the sensor's numbers, with how much red, green and blue light comes back,
%.  The shares are nominal: real surfaces and sensors differ."""

RAW_PER_PERCENT = 3.5
"""Raw value per percent of light in RGB-RAW and REF-RAW: white paper gives some 300."""
RAW_REFERENCE = 600
"""Raw value of the reference channel."""

BUTTONS = (
    "none",
    "top_left",
    "bottom_left",
    "top_right",
    "bottom_right",
    "top_left+top_right",
    "top_left+bottom_right",
    "bottom_left+top_right",
    "bottom_left+bottom_right",
    "beacon",
    "top_left+bottom_left",
    "top_right+bottom_right",
)
"""Buttons held on the remote control, in the order of the sensor's numbers."""

_REMOTE_BITS = {"top_left": 0x10, "bottom_left": 0x20, "top_right": 0x40, "bottom_right": 0x80}
_NO_BUTTON, _BEACON_ON = 384, 262
_NO_BEACON = -128


def _mode(
    name: str, measure: Optional["Measure"], lowest: float, highest: float, **rest: Any
) -> Mode:
    fields = {
        "count": 1,
        "decimals": 0,
        "units": "",
        "format": "s8",
        "single": False,
    }  # type: Dict[str, Any]
    fields.update(rest)
    return Mode(name=name, measure=measure, lowest=lowest, highest=highest, **fields)


# Measuring


def _light_back(m: "Measuring") -> List[float]:
    """Return the shares of red, green and blue light that come back, %."""
    grey = m("reflect") if m.given("reflect") else None
    surface = dict(SURFACES)[m("surface")] if grey is None else (grey, grey, grey)
    pairs = zip(("red", "green", "blue"), surface)
    return [(m(key) if m.given(key) else share) + m.noise() for key, share in pairs]


def _colour(m: "Measuring") -> List[int]:
    """Return the number of the surface that is nearest."""
    light = _light_back(m)
    distances = [sum((a - b) ** 2 for a, b in zip(light, known)) for _, known in SURFACES]
    return [distances.index(min(distances))]


def _raw(m: "Measuring") -> List[float]:
    return [RAW_PER_PERCENT * share for share in _light_back(m)] + [RAW_REFERENCE]


def _echo(m: "Measuring") -> float:
    distance = m("distance") + m.noise()
    return distance if distance <= MAX_ECHO_DISTANCE else NO_ECHO


def _seek(m: "Measuring") -> List[float]:
    values = []
    for channel in CHANNELS:
        distance = m(channel + ".beacon")
        values.append(m(channel + ".heading") if distance >= 0 else 0)
        values.append(distance if distance >= 0 else _NO_BEACON)
    return values


def _remote(m: "Measuring") -> List[int]:
    return [BUTTONS.index(m(channel + ".buttons")) for channel in CHANNELS]


def _remote_bits(m: "Measuring") -> List[int]:
    """Return the buttons of channel 1 as bits, with the checksum that stands below them."""
    word = m("1.buttons")
    if word in ("none", "beacon"):
        return [_NO_BUTTON if word == "none" else _BEACON_ON]
    bits = sum(_REMOTE_BITS[button] for button in word.split("+"))
    check = (bits >> 4 & 1) | (~bits >> 4 & 2) | (~bits >> 4 & 4)
    odd = bin(check).count("1") % 2
    return [0x100 | bits | odd << 3 | check]


def _one(key: str) -> "Measure":
    return lambda m: [m(key)]


def _noisy(key: str) -> "Measure":
    return lambda m: [m(key) + m.noise()]


def _rate(m: "Measuring") -> float:
    return m.rate("angle") + m.noise()


# Quantities

_PERCENT = (0.0, 100.0)
_YES = (0, 1)
_PLACE = (-200.0, 200.0)


def _noise(unit: str, what: str) -> Constant:
    return Constant(0.0, (0.0, 50.0), unit, "sigma of the noise of " + what)


def _axis(name: str) -> Constant:
    return Constant(0.0, _PLACE, "cm", "where the sensor is, " + name)


_PRESSED = {"pressed": Constant(0, _YES, "", "1 while it is pressed", int)}
_HEARD = Constant(0, _YES, "", "1 while another such sensor is heard", int)

_DISTANCE = {
    "distance": Constant(NO_ECHO, (0.0, 1000.0), "cm", "to what is in front, or tip, or wall"),
    "heard": _HEARD,
    "x": _axis("x; of a wall, where it stands across the robot's way"),
    "y": _axis("y"),
    "z": _axis("z"),
    "noise": _noise("cm", "the distance"),
}

_LIGHT = {
    "surface": Constant("white", tuple(name for name, _ in SURFACES), "", "what is in front", str),
    "reflect": Constant(None, _PERCENT, "pct", "light that a grey surface sends back; or line"),
    "red": Constant(None, _PERCENT, "pct", "red light that comes back"),
    "green": Constant(None, _PERCENT, "pct", "green light that comes back"),
    "blue": Constant(None, _PERCENT, "pct", "blue light that comes back"),
    "ambient": Constant(5.0, _PERCENT, "pct", "light around"),
    "x": Constant(8.0, _PLACE, "cm", "how far before the wheels it is, where it sees the line"),
    "y": Constant(0.0, _PLACE, "cm", "how far to the robot's left"),
    "noise": _noise("pct", "the reflected light"),
}

_GYRO = {
    "angle": Constant(0.0, (-1e5, 1e5), "deg", "clockwise; or a link's name, or robot"),
    "rate": Constant(0.0, (-1e4, 1e4), "deg/s", "comes on top of the angle, as drift does"),
    "tilt": Constant(0.0, (-1e5, 1e5), "deg", "about the second axis"),
    "flipped": Constant(0, _YES, "", "1 if mounted upside down: the angle goes the other way", int),
    "noise": _noise("deg/s", "the rate"),
}

_INFRARED = {
    "distance": Constant(100.0, _PERCENT, "pct", "to what is in front; 100 is some 70 cm"),
    "heading": Constant(0.0, (-25.0, 25.0), "", "of the beacon, positive to the right"),
    "beacon": Constant(
        -1.0, (-1.0, 100.0), "pct", "distance of the beacon; 100 is some 200 cm, -1: there is none"
    ),
    "buttons": Constant("none", BUTTONS, "", "held on the remote control", str),
    "noise": _noise("pct", "the distance"),
}

_SOUND = {
    "level": Constant(5.0, _PERCENT, "pct", "loudness"),
    "low": Constant(None, _PERCENT, "pct", "loudness as ears weigh it; as level if not given"),
    "noise": _noise("pct", "the loudness"),
}

_NXT_LIGHT = {
    "reflect": Constant(40.0, _PERCENT, "pct", "light that comes back from the sensor's LED"),
    "ambient": Constant(20.0, _PERCENT, "pct", "light around"),
    "noise": _noise("pct", "the reflected light"),
}


# Kinds


def _touch(driver: str, connection: str, volts: "Volts" = None) -> Kind:
    modes = (_mode("TOUCH", _one("pressed"), 0, 1, format="s32"),)
    return Kind(driver, connection, _PRESSED, ("pressed",), {}, modes, volts)


def _ultrasonic_modes(
    order: Sequence[str], decimals: int, most_cm: float, most_in: float
) -> Tuple[Mode, ...]:
    def centimetres(m: "Measuring") -> List[float]:
        return [_echo(m)]

    def inches(m: "Measuring") -> List[float]:
        return [_echo(m) / INCH]

    modes = {"US-LISTEN": _mode("US-LISTEN", _one("heard"), 0, 1)}
    for name in order:
        if name not in modes:
            cm = name.endswith("CM")
            modes[name] = _mode(
                name,
                centimetres if cm else inches,
                0,
                most_cm if cm else most_in,
                decimals=decimals if cm else 1,
                units="cm" if cm else "in",
                format="s16" if decimals or not cm else "u8",
                single="-SI-" in name,
            )
    return tuple(modes[name] for name in order)


def _ultrasonic(driver: str, connection: str, order: str, decimals: int, most_in: float) -> Kind:
    modes = _ultrasonic_modes(order.split(), decimals, NO_ECHO, most_in)
    environment = {"distance": ("tip", "wall")}
    return Kind(driver, connection, _DISTANCE, ("distance",), environment, modes, None)


def _low_level(m: "Measuring") -> List[float]:
    return [(m("low") if m.given("low") else m("level")) + m.noise()]


_BY_PERCENT = {"decimals": 1, "units": "pct", "format": "s32"}

KINDS = {
    "touch": _touch("lego-ev3-touch", "ev3-analog"),
    "nxt-touch": _touch("lego-nxt-touch", "nxt-analog", lambda m: 0.2 if m("pressed") else 5.0),
    "color": Kind(
        "lego-ev3-color",
        "ev3-uart",
        _LIGHT,
        ("surface", "reflect"),
        {"reflect": ("line",)},
        (
            _mode("COL-REFLECT", lambda m: _light_back(m)[:1], 0, 100, units="pct"),
            _mode("COL-AMBIENT", _one("ambient"), 0, 100, units="pct"),
            _mode("COL-COLOR", _colour, 0, 7, units="col"),
            _mode(
                "REF-RAW",
                lambda m: [RAW_REFERENCE - _raw(m)[0], RAW_REFERENCE],
                0, 1023, count=2, format="s16",
            ),
            _mode("RGB-RAW", _raw, 0, 1023, count=4, format="s16"),
            _mode("COL-CAL", None, 0, 65535, count=3, format="u16"),
        ),
        None,
    ),
    "ultrasonic": _ultrasonic(
        "lego-ev3-us",
        "ev3-uart",
        "US-DIST-CM US-DIST-IN US-LISTEN US-SI-CM US-SI-IN US-DC-CM US-DC-IN",
        1,
        100.3,
    ),
    "nxt-ultrasonic": _ultrasonic(
        "lego-nxt-us",
        "nxt-i2c",
        "US-DIST-CM US-DIST-IN US-SI-CM US-SI-IN US-LISTEN",
        0,
        100.0,
    ),
    "gyro": Kind(
        "lego-ev3-gyro",
        "ev3-uart",
        _GYRO,
        ("angle",),
        {"angle": ("robot", "base", "shoulder", "elbow")},
        (
            _mode(
                "GYRO-ANG", lambda m: [m.turned("angle")], -32768, 32767,
                units="deg", format="s16",
            ),
            _mode(
                "GYRO-RATE", lambda m: [_rate(m)], -440, 440, units="d/s", format="s16"
            ),
            _mode("GYRO-FAS", lambda m: [_rate(m)], -1464, 1535, format="s16"),
            _mode(
                "GYRO-G&A",
                lambda m: [m.turned("angle"), max(-440, min(440, _rate(m)))],
                -32768, 32767, count=2, format="s16",
            ),
            _mode("GYRO-CAL", lambda m: 4 * [0], -32768, 32767, count=4, format="s16"),
            _mode("TILT-RATE", lambda m: [m.rate("tilt")], -440, 440, units="d/s", format="s16"),
            _mode(
                "TILT-ANG", lambda m: [m.turned("tilt")], -32768, 32767, units="deg", format="s16"
            ),
        ),
        None,
    ),
    "infrared": Kind(
        "lego-ev3-ir",
        "ev3-uart",
        _INFRARED,
        ("distance",),
        {},
        (
            _mode("IR-PROX", _noisy("distance"), 0, 100, units="pct"),
            _mode("IR-SEEK", _seek, -128, 100, count=8, units="pct"),
            _mode("IR-REMOTE", _remote, 0, 11, count=4, units="btn"),
            _mode("IR-REM-A", _remote_bits, 0, 511, format="s16"),
            _mode("IR-S-ALT", None, 0, 100, count=4, units="pct"),
            _mode("IR-CAL", None, 0, 1023, count=2, format="s16"),
        ),
        None,
    ),
    "sound": Kind(
        "lego-nxt-sound",
        "nxt-analog",
        _SOUND,
        ("level",),
        {},
        (
            _mode("DB", _noisy("level"), 0, 100, **_BY_PERCENT),
            _mode("DBA", _low_level, 0, 100, **_BY_PERCENT),
        ),
        lambda m: 0.05 * m("level"),
    ),
    "light": Kind(
        "lego-nxt-light",
        "nxt-analog",
        _NXT_LIGHT,
        ("reflect",),
        {},
        (
            _mode("REFLECT", _noisy("reflect"), 0, 100, **_BY_PERCENT),
            _mode("AMBIENT", _one("ambient"), 0, 100, **_BY_PERCENT),
        ),
        lambda m: 4.164 - 0.03391 * m("ambient"),  # its LED is off
    ),
}  # fmt: skip

GENERIC = "nxt-analog"
"""Driver of an NXT/Analog sensor before `set_device` names another."""

UNKNOWN = (KINDS["sound"].driver,)
"""Drivers of sensors that the brick only detects as NXT/Analog."""


def generic(kind: Kind) -> Kind:
    """Return a kind of NXT/Analog sensor as the brick detects it: a voltage."""
    volts = kind.volts
    assert volts is not None, "only these show the brick a voltage"
    modes = tuple(
        _mode(name, lambda m: [volts(m)], 0, 5, decimals=3, units="V", format="s32")
        for name in ("ANALOG-0", "ANALOG-1")
    )
    return kind._replace(driver=GENERIC, modes=modes)
