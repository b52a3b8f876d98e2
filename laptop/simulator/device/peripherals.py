"""What sits on the brick besides its motors: buttons, touch sensors, LEDs, battery, sound, screen.

Rule: everything here is driven by the world's clock and keeps a memory that can be asked
afterwards; no sound is played and no program of the laptop is started.  Every read or write of a
device costs one sysfs access.

Simplifications: a touch sensor is plugged into each of the four inputs; an LED's `delay_on` and
`delay_off` files are always there; the LCD console is known by its font size only.
"""

import array
import collections
import errno
import os
import re
import shlex
import tempfile
import types
import wave

from shared.arm_description import ArmError

#: Key codes of the brick's buttons, by the names python-ev3dev2 gives them.
BUTTONS = {"up": 103, "down": 108, "left": 105, "right": 106, "enter": 28, "backspace": 14}
TOUCH_PORTS = ("in1", "in2", "in3", "in4")
LEDS = ("led0:red:brick-status", "led0:green:brick-status",
        "led1:red:brick-status", "led1:green:brick-status")  # fmt: skip
WIDTH, HEIGHT = 178, 128

EV_SYN, EV_KEY = 0, 1
_EVIOCGKEY_NUMBER = ord("E") << 8 | 0x18
_FBIOGET_VSCREENINFO = 0x4600
_FBIOGET_FSCREENINFO = 0x4602


class BadPress(ArmError, ValueError):
    """A button press that cannot be understood."""


Press = collections.namedtuple("Press", ["button", "t", "duration"])
Press.__doc__ = """A button held down from `t` for `duration`, both in s."""


def read_press(text):
    """A Press from `BUTTON@SECONDS` or `BUTTON@SECONDS+SECONDS_HELD`, e.g. `enter@2.0`.

    Raises:
        BadPress
    """
    names = sorted(BUTTONS) + ["back", "touch"] + ["touch:" + port for port in TOUCH_PORTS]
    match = re.match(r"^([\w:]+)@(\d+(?:\.\d*)?|\.\d+)(?:\+(\d+(?:\.\d*)?|\.\d+))?$", text)
    if not match or match.group(1) not in names:
        raise BadPress(
            "press {!r}: not BUTTON@SECONDS or BUTTON@SECONDS+SECONDS_HELD; "
            "the buttons are {}".format(text, ", ".join(names))
        )
    button, t, duration = match.groups()
    return Press("backspace" if button == "back" else button, float(t), float(duration or 0.2))


def _invalid():
    return OSError(errno.EINVAL, os.strerror(errno.EINVAL))


class _Device(object):
    """A device whose attributes are mostly constants."""

    notifications = 0

    def __init__(self, constants):
        self.constants = constants

    def read(self, attribute):
        """The attribute's text."""
        if attribute not in self.constants:
            raise OSError(errno.ENOENT, os.strerror(errno.ENOENT), attribute)
        return self.constants[attribute]

    def write(self, attribute, value):
        """Set the attribute."""
        raise OSError(errno.EACCES, os.strerror(errno.EACCES), attribute)


class TouchSensor(_Device):
    """A lego-ev3-touch sensor; `pressed` is its state."""

    def __init__(self, port):
        super(TouchSensor, self).__init__(
            {
                "address": "ev3-ports:" + port,
                "driver_name": "lego-ev3-touch",
                "mode": "TOUCH",
                "modes": "TOUCH",
                "decimals": "0",
                "num_values": "1",
                "units": "",
                "bin_data_format": "s8",
            }
        )
        self.pressed = False

    def read(self, attribute):
        """The attribute's text."""
        if attribute == "value0":
            return str(int(self.pressed))
        if attribute == "bin_data":
            return chr(int(self.pressed))
        return super(TouchSensor, self).read(attribute)

    def write(self, attribute, value):
        """Set the attribute."""
        if attribute != "mode":
            super(TouchSensor, self).write(attribute, value)
        if value != "TOUCH":
            raise _invalid()


class Led(_Device):
    """One of the four LEDs; `history` holds (s, brightness) from the start on."""

    TRIGGERS = ("none", "default-on", "timer", "heartbeat")

    def __init__(self, world, brightness):
        super(Led, self).__init__({"max_brightness": "255"})
        self._world = world
        self._delays = {"delay_on": 500, "delay_off": 500}
        self.trigger = "none"
        self.history = [(world.now(), brightness)]

    @property
    def brightness(self):
        """0 to 255."""
        return self.history[-1][1]

    def read(self, attribute):
        """The attribute's text."""
        if attribute == "brightness":
            return str(self.brightness)
        if attribute == "trigger":
            words = ("[{}]".format(t) if t == self.trigger else t for t in self.TRIGGERS)
            return " ".join(words)
        if attribute in self._delays:
            return str(self._delays[attribute])
        return super(Led, self).read(attribute)

    def write(self, attribute, value):
        """Set the attribute."""
        if attribute == "trigger":
            if value not in self.TRIGGERS:
                raise _invalid()
            self.trigger = value
            return
        if attribute != "brightness" and attribute not in self._delays:
            super(Led, self).write(attribute, value)
        if not value.isdigit():
            raise _invalid()
        if attribute in self._delays:
            self._delays[attribute] = int(value)
            return
        self.history.append((self._world.now(), min(255, int(value))))
        if int(value) == 0:
            self.trigger = "none"


class Battery(_Device):
    """The brick's power supply.

    Args:
        voltage, current: callables, V and A.
    """

    def __init__(self, voltage, current):
        super(Battery, self).__init__(
            {
                "technology": "Unknown",
                "type": "Battery",
                "scope": "System",
                "voltage_max_design": "7500000",
                "voltage_min_design": "6200000",
            }
        )
        self._now = {"voltage_now": voltage, "current_now": current}

    def read(self, attribute):
        """The attribute's text."""
        if attribute in self._now:
            return str(int(round(self._now[attribute]() * 1e6)))
        return super(Battery, self).read(attribute)


class InputEvent(collections.namedtuple("InputEvent", "sec usec type code value")):
    """As python-evdev's."""

    __slots__ = ()

    def timestamp(self):
        """When it happened, s."""
        return self.sec + self.usec / 1e6


class ButtonPanel(object):
    """The six buttons; `listeners` are called with each InputEvent."""

    def __init__(self, world):
        self._world = world
        self.down = set()
        self.listeners = []

    def set(self, button, down):
        """Push or release a button."""
        if (button in self.down) == down:
            return
        (self.down.add if down else self.down.discard)(button)
        sec, usec = divmod(int(round(self._world.now() * 1e6)), 1000000)
        for listener in list(self.listeners):
            listener(InputEvent(sec, usec, EV_KEY, BUTTONS[button], int(down)))
            listener(InputEvent(sec, usec, EV_SYN, 0, 0))

    def bits(self):
        """The key states as the EVIOCGKEY ioctl hands them out."""
        state = array.array("B", [0] * 96)
        for button in self.down:
            state[BUTTONS[button] // 8] |= 1 << BUTTONS[button] % 8
        return state


class EventFile(object):
    """The buttons' device file, opened."""

    name = "/dev/input/by-path/platform-gpio_keys-event"

    def __init__(self, panel):
        self.panel = panel

    def close(self):
        """Nothing to let go of."""


class Sound(bytes):
    """Sampled sound in a pipe: empty bytes that know how long they last, s."""

    seconds = 0.0


Finished = collections.namedtuple("Finished", ["status", "output", "errors", "seconds"])
Finished.__doc__ = (
    """What a program of the brick did: exit status, bytes, bytes, and how long, s."""
)


class Peripherals(object):
    """All of it, plugged into a sysfs.

    Args:
        world: the clock.
        sysfs: where the devices are found and accesses are counted.
        voltage, current: callables giving the battery's V and A.

    Attributes:
        leds: name -> Led.  touch: port -> TouchSensor.  buttons: ButtonPanel.
        commands: (s, command line) of every program the script started.
        volume: percent.  font: (width, height) of a console character in pixels.
    """

    def __init__(self, world, sysfs, voltage=lambda: 8.0, current=lambda: 0.2):
        self._world = world
        self._sysfs = sysfs
        self.buttons = ButtonPanel(world)
        self.on_back = None
        self.touch = {}
        self.leds = {}
        self.commands = []
        self.volume = 100
        self.font = (8, 16)
        self._screen = None
        self._picture = None
        self._files = {}
        for index, port in enumerate(TOUCH_PORTS):
            self.touch[port] = TouchSensor(port)
            found = {key: self.touch[port].constants[key] for key in ("address", "driver_name")}
            self._add("lego-sensor", "sensor{}".format(index), found, self.touch[port])
        for name in LEDS:
            self.leds[name] = Led(world, 255 if "green" in name else 0)
            self._add("leds", name, {"delay_on": "500", "delay_off": "500"}, self.leds[name])
        battery = Battery(voltage, current)
        self._add("power_supply", "lego-ev3-battery", {"type": "Battery"}, battery)

    def _add(self, class_name, device_name, discovery, device):
        self._files[class_name + "/" + device_name] = device
        self._sysfs.add(class_name, device_name, discovery, device)

    def press(self, press):
        """Schedule a Press."""
        self._world.at(press.t, lambda: self._set(press.button, True))
        self._world.at(press.t + press.duration, lambda: self._set(press.button, False))

    def _set(self, button, down):
        if button.startswith("touch"):
            for port in TOUCH_PORTS:
                if button in ("touch", "touch:" + port):
                    self.touch[port].pressed = down
        else:
            self.buttons.set(button, down)
            if button == "backspace" and down and self.on_back is not None:
                self.on_back()

    # Device files

    def open(self, path):
        """What the script gets for a device file of the brick, or None for any other file."""
        if path.startswith("/dev/input/"):
            return EventFile(self.buttons)
        if path.startswith("/sys/class/"):
            folder, attribute = os.path.split(path[len("/sys/class/") :])
            if not self._sysfs.has(folder):
                raise OSError(errno.ENOENT, os.strerror(errno.ENOENT), path)
            return self._sysfs.open(folder, attribute)
        return None

    def open_screen(self):
        """A descriptor of the framebuffer, to be mapped; the caller closes it."""
        if self._screen is None:
            self._screen = tempfile.TemporaryFile()  # noqa: SIM115 close_screen closes it
            self._screen.truncate(4 * WIDTH * HEIGHT)
        return os.dup(self._screen.fileno())

    def screen(self):
        """The LCD's graphics as bytes of grey, row by row, or None when it was never opened."""
        if self._screen is not None:
            self._screen.seek(0)
            self._picture = self._screen.read()[1::4]
        return self._picture

    def close_screen(self):
        """Keep what is on the LCD and let go of the framebuffer."""
        self.screen()
        if self._screen is not None:
            self._screen.close()
            self._screen = None

    def ioctl(self, file, request, argument, screens):
        """Answer an ioctl on the buttons or the framebuffer; False when it is neither.

        Args:
            screens: the descriptors `open_screen` has handed out.
        """
        if isinstance(file, EventFile):
            if request & 0xFFFF != _EVIOCGKEY_NUMBER:
                raise _invalid()
            self._sysfs.touch()
            bits = file.panel.bits()
            argument[: min(len(argument), len(bits))] = bits[: len(argument)]
            return True
        if file not in screens:
            return False
        if request == _FBIOGET_FSCREENINFO:
            argument.id_name = b"ST7586"
            argument.smem_len = 4 * WIDTH * HEIGHT
            argument.line_length = 4 * WIDTH
        elif request == _FBIOGET_VSCREENINFO:
            argument.xres = argument.xres_virtual = WIDTH
            argument.yres = argument.yres_virtual = HEIGHT
            argument.bits_per_pixel = 32
        else:
            raise _invalid()
        return True

    # Programs the script starts

    def command(self, words, piped=0.0):
        """Do what the program `words[0]` would on the brick; None when there is no such program.

        Args:
            piped: seconds of sound in the pipe that is its standard input.
        """
        name = os.path.basename(words[0])
        program = getattr(self, "_run_" + name.replace("-", "_"), None)
        self.commands.append((self._world.now(), " ".join(words)))
        return program and program(words[1:], piped)

    def _run_beep(self, words, piped):
        length, delay, pause, repeats, total = 0.2, 0.0, 0.1, 1, 0.0
        words = [part for word in words for part in _split_option(word)]
        while words:
            option = words.pop(0)
            if option in ("-n", "--new"):
                total += repeats * (length + delay) + (repeats - 1) * pause
                length, delay, pause, repeats = 0.2, 0.0, 0.1, 1
            elif option in ("-f", "-l", "-r", "-d", "-D"):
                try:
                    value = float(words.pop(0))
                except (IndexError, ValueError):
                    return Finished(1, b"", b"beep: invalid option\n", 0.01)
                if option == "-l":
                    length = value / 1000.0
                elif option == "-r":
                    repeats = int(value)
                elif option == "-d":
                    pause, delay = value / 1000.0, 0.0
                elif option == "-D":
                    pause, delay = 0.0, value / 1000.0
        total += repeats * (length + delay) + (repeats - 1) * pause
        return Finished(0, b"", b"", total)

    def _run_aplay(self, words, piped):
        seconds = piped
        for word in words:
            if word.endswith(".wav"):
                try:
                    with wave.open(word, "rb") as file:
                        seconds += file.getnframes() / float(file.getframerate())
                except (OSError, EOFError, wave.Error) as error:
                    message = "aplay: {}: {}\n".format(word, error)
                    return Finished(1, b"", message.encode(), 0.01)
        return Finished(0, b"", b"", seconds)

    def _run_espeak(self, words, piped):
        words = list(words)
        into_pipe = "--stdout" in words
        per_minute, text = 175.0, []
        while words:
            word = words.pop(0)
            if word == "-s" and words:
                per_minute = max(80.0, float(words.pop(0)))
            elif word in ("-a", "-v", "-p", "-g", "-k", "-l") and words:
                words.pop(0)
            elif not word.startswith("-"):
                text.append(word)
        # A spoken word is taken as six characters.
        seconds = 0.2 + len(" ".join(text)) / 6.0 * 60.0 / per_minute
        sound = Sound()
        sound.seconds = seconds
        if into_pipe:
            return Finished(0, sound, b"", 0.0)
        return Finished(0, b"", b"", seconds)

    def _run_amixer(self, words, piped):
        quiet = "-q" in words
        words = [word for word in words if word != "-q"]
        if words[:1] == ["scontrols"]:
            return Finished(0, b"Simple mixer control 'PCM',0\n", b"", 0.01)
        for word in words[1:]:
            if re.match(r"^\d+%$", word):
                self.volume = min(100, int(word[:-1]))
        report = "Simple mixer control 'PCM',0\n  Mono: Playback {0} [{0}%] [on]\n"
        return Finished(0, b"" if quiet else report.format(self.volume).encode(), b"", 0.01)

    def _run_setfont(self, words, piped):
        match = re.search(r"(\d+)(?:x(\d+))?(?:\.psf)?(?:\.gz)?$", words[-1] if words else "")
        if match:
            # Names give height x width; a lone number is the height of an 8 pixel wide font.
            self.font = (int(match.group(2) or 8), int(match.group(1)))
        return Finished(0, b"", b"", 0.05)

    def _run_stty(self, words, piped):
        output = b""
        if words == ["size"]:
            width, height = self.font
            output = "{} {}\n".format(HEIGHT // height, WIDTH // width).encode()
        return Finished(0, output, b"", 0.01)

    def _run_clear(self, words, piped):
        return Finished(0, b"\x1b[H\x1b[2J", b"", 0.01)

    def _run_echo(self, words, piped):
        return Finished(0, (" ".join(words) + "\n").encode(), b"", 0.01)

    def _run_sleep(self, words, piped):
        return Finished(0, b"", b"", float(words[0]))

    def _run_true(self, words, piped):
        return Finished(0, b"", b"", 0.0)

    def _run_hostname(self, words, piped):
        return Finished(0, b"ev3dev\n", b"", 0.01)

    _run_sync = _run_tput = _run_chvt = _run_true

    # The evdev package, which is on the brick but not on every laptop

    def evdev_module(self, waiting_line):
        """A module that stands for `evdev`, as far as python-ev3dev2 and key loops need it.

        Args:
            waiting_line: makes a `WaitingLine` for threads that wait for a key.
        """
        sysfs, panel = self._sysfs, self.buttons

        class InputDevice(object):
            """The brick's buttons; it sees the events since it was opened."""

            name = "EV3 Brick Buttons"
            path = fn = "/dev/input/event0"

            def __init__(self, path=path):
                self._events = collections.deque()
                self._waiting = waiting_line()
                panel.listeners.append(self._hear)

            def _hear(self, event):
                self._events.append(event)
                self._waiting.wake()

            def read_one(self):
                """The next event, or None."""
                sysfs.touch()
                return self._events.popleft() if self._events else None

            def read(self):
                """All events so far."""
                sysfs.touch()
                while self._events:
                    yield self._events.popleft()

            def read_loop(self):
                """Events for ever, waiting for each."""
                while True:
                    sysfs.touch()
                    while not self._events:
                        self._waiting.wait()
                    yield self._events.popleft()

            def active_keys(self):
                """Codes of the buttons held down."""
                sysfs.touch()
                return sorted(BUTTONS[button] for button in panel.down)

            def close(self):
                """Hear no more."""
                if self._hear in panel.listeners:
                    panel.listeners.remove(self._hear)

        codes = {"EV_SYN": EV_SYN, "EV_KEY": EV_KEY}
        codes.update(("KEY_" + button.upper(), BUTTONS[button]) for button in BUTTONS)
        module = types.ModuleType("evdev")
        module.ecodes = types.ModuleType("evdev.ecodes")
        vars(module.ecodes).update(codes)
        module.InputDevice = InputDevice
        module.InputEvent = InputEvent
        module.list_devices = lambda input_device_dir="/dev/input": [InputDevice.path]
        return module


def _split_option(word):
    """`-l100` as `-l 100`."""
    match = re.match(r"^(-[flrdD])(.+)$", word)
    return match.groups() if match else (word,)


def split_line(line):
    """The simple commands of a shell line, in order, as (words, in background, reads the pipe).

    Understands quotes, `;`, `&&`, `&`, `|`; drops redirections.

    Raises:
        ValueError: an unclosed quote.
    """
    parts = re.findall(
        r"""(?:[^\s;&|<>"'\\]|\\.|"(?:[^"\\]|\\.)*"|'[^']*')+|[;&|\n]+|[<>]+&?|["']""", line
    )
    commands, words, piped, skip = [], [], False, False
    for part in parts + [";"]:
        if not part.strip(";&|\n"):
            if words:
                commands.append((words, part == "&", piped))
            words, piped = [], part == "|"
        elif not part.strip("<>&"):
            skip = True
            if words and words[-1].isdigit():
                words.pop()
        elif skip:
            skip = False
        else:
            words.extend(shlex.split(part))
    return commands
