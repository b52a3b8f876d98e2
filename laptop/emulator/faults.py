"""Faults on an emulated brick and their times: read, and scheduled."""

import re
from functools import partial
from typing import Any, Dict, Iterable, NamedTuple, Optional

from laptop.emulator.device.buttons import INPUTS, MAX_ORDER_TIME
from laptop.emulator.host.linux import Signals
from shared.arm_description import ArmError
from shared.message_fields import one_line

MYPY = False
if MYPY:
    from typing import Collection, Protocol  # noqa: F401

    from laptop.emulator.device.attribute_devices import DeviceWorld  # noqa: F401
    from laptop.emulator.device.brick import EmulatedBrick  # noqa: F401
    from laptop.emulator.device.peripherals import Peripherals  # noqa: F401
    from laptop.emulator.picture_faults import PictureFaults  # noqa: F401
    from robot.tracker_address import SaltedKey  # noqa: F401

    class WatchingTracker(Protocol):
        """A tracker before the cameras of a brick, on this machine."""

        @property
        def port(self) -> int:
            """TCP port on which it listens."""

        @property
        def code(self) -> str:
            """Its pairing code."""

        @property
        def key(self) -> SaltedKey:
            """Key of the code, for bricks that have paired before."""

        @property
        def frames(self) -> Collection[str]:
            """Names of its cameras."""

        @property
        def pictures(self) -> PictureFaults:
            """Faults of their pictures."""


Fault = NamedTuple("Fault", [("kind", str), ("what", Any), ("t", float)])
Fault.__doc__ = """A fault that comes at a time.

Attributes:
    kind: a word of FAULTS, such as "stall".
    what: its port, camera or value; None where it takes none.
    t: s.
"""

CAMERA_NAMES = "ABCDEFGH"
"""Names that a camera may have."""

FAULTS = {
    "unplug": "PORT",
    "stall": "PORT",
    "dead-encoder": "PORT",
    "push": "PORT",
    "slow-sysfs": "SECONDS",
    "frozen-picture": "CAMERA",
    "freeze": None,
    "kill": None,
    "int": None,
    "term": None,
    "hup": None,
}
"""Kinds of faults: {kind: placeholder behind its colon}; CAMERA may be left out."""

_PORTS = {"unplug": tuple("ABCD") + INPUTS}
"""Ports of faults that can happen to sensors, too."""

MAX_ACCESS_COST = 10.0
"""Greatest cost of a sysfs access, s."""


class InvalidSimulationOption(ArmError, ValueError):
    """A fault, pose or plug that cannot be understood."""


def read_fault(text: str) -> Fault:
    """Read a Fault from `KIND[:WHAT]@SECONDS`, e.g. `unplug:A@1.5` or `term@2`."""
    match = re.match(r"([a-z-]+)(?::([^@]+))?@([0-9.]+)$", text)
    if not match or match.group(1) not in FAULTS:
        raise InvalidSimulationOption(
            "'{}' is not a fault; write one of {} with a time, like unplug:A@1.5".format(
                one_line(text),
                ", ".join(
                    kind + (":" + what if what else "") for kind, what in sorted(FAULTS.items())
                ),
            )
        )
    kind, what = match.group(1), match.group(2)  # type: str, Any
    try:
        t = float(match.group(3))
        if FAULTS[kind] == "SECONDS":
            what = float(what)
            if not 0 <= what <= MAX_ACCESS_COST:
                raise ValueError(what)
        elif FAULTS[kind] == "CAMERA":
            if what not in (None,) + tuple(CAMERA_NAMES):
                raise ValueError(what)
        elif what not in (_PORTS.get(kind, tuple("ABCD")) if FAULTS[kind] == "PORT" else (None,)):
            raise ValueError(what)
    except (TypeError, ValueError):
        raise InvalidSimulationOption(
            "fault '{}': {} takes {}, then @SECONDS".format(
                one_line(text),
                kind,
                {
                    "PORT": "a port from A to D" + (", or in1 to in4" if kind in _PORTS else ""),
                    "CAMERA": "a camera from A to H, or nothing for all of them",
                    None: "nothing",
                }.get(FAULTS[kind], "SECONDS from 0 to {:g}".format(MAX_ACCESS_COST)),
            )
        ) from None
    if t > MAX_ORDER_TIME:
        raise InvalidSimulationOption(
            "fault '{}': it would come at {:g} s; give a time up to {:g} s".format(
                one_line(text), t, MAX_ORDER_TIME
            )
        )
    return Fault(kind, what, t)


def schedule_faults(
    brick: "EmulatedBrick", devices: "Peripherals", faults: Iterable[Fault]
) -> Dict[str, Any]:
    """Schedule the faults on the brick; return those of the program, for run_script."""
    ordered = {"signals": []}  # type: Dict[str, Any]
    for fault in faults:
        if fault.kind not in FAULTS:
            raise InvalidSimulationOption(
                "'{}' is not a fault; there are {}".format(fault.kind, ", ".join(sorted(FAULTS)))
            )
        if FAULTS[fault.kind] == "CAMERA":
            continue
        if fault.what in INPUTS:
            brick.world.at(brick.world.now() + fault.t, devices.inputs[fault.what].unplug)
            continue
        if FAULTS[fault.kind] == "PORT" and fault.what not in brick.motors:
            raise InvalidSimulationOption(
                "fault {}: no motor at port {}; there are {}".format(
                    fault.kind, fault.what, ", ".join(sorted(brick.motors)) or "none; give --plug"
                )
            )
        _schedule(brick, fault, ordered)
    return ordered


def _schedule(brick: "EmulatedBrick", fault: Fault, ordered: Dict[str, Any]) -> None:
    at, t = brick.world.at, brick.world.now() + fault.t
    if fault.kind == "unplug":
        at(t, lambda: brick.unplug(fault.what))
    elif fault.kind == "stall":
        at(t, lambda: brick.jam(fault.what))
    elif fault.kind == "dead-encoder":
        at(t, lambda: brick.kill_encoder(fault.what))
    elif fault.kind == "push":
        at(t, lambda: brick.push(fault.what))
    elif fault.kind == "slow-sysfs":
        at(t, lambda: setattr(brick.sysfs, "access_cost", fault.what))
    elif fault.kind in ("freeze", "kill"):
        ordered[fault.kind + "_at"] = t
    else:
        ordered["signals"].append((t, Signals["SIG" + fault.kind.upper()]))


def schedule_pictures(
    world: "DeviceWorld", tracker: Optional["WatchingTracker"], faults: Iterable[Fault]
) -> None:
    """Schedule the faults of the cameras."""
    for fault in faults:
        if FAULTS[fault.kind] != "CAMERA":
            continue
        cameras = sorted(tracker.frames) if tracker else []
        if tracker is None or not cameras:
            raise InvalidSimulationOption(
                "fault {}: no camera watches; give --scene, too".format(fault.kind)
            )
        if fault.what not in [None] + cameras:
            raise InvalidSimulationOption(
                "fault {}: no camera {}; there are {}".format(
                    fault.kind, fault.what, ", ".join(cameras)
                )
            )
        world.at(world.now() + fault.t, partial(tracker.pictures.freeze, fault.what))
