"""Guide through the printed crosses, which gathers what arm and camera have of each."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from laptop.see.markers.board import CROSSES
from laptop.see.table.camera_fit import BadCalibration, Calibration
from laptop.see.table.camera_report import shift_since
from laptop.see.table.cross_sampling import CrossSample
from laptop.see.table.marker_offset import JOINTS_SIGMA, BadTouches, MarkerFit, Touch, fit_marker
from robot.motion import kinematics
from shared.arm_description import PULLED_DOWN, Arm
from shared.config_files import InvalidFile, number, parse_json
from shared.message_fields import printable

CROSS_NAMES = (
    *("top left", "top middle", "top right"),
    *("middle left", "the centre", "middle right"),
    *("bottom left", "bottom middle", "bottom right"),
)
"""Places of crosses 1 to 9 on the sheet, its writing upright."""
MAX_TIP_DIFFERENCE = 0.02
"""Greatest distance between the tip's places by brick and by laptop for one arm file, cm."""
MAX_SCALE_ERROR, MAX_PLACE_ERROR = 0.07, 0.6
"""Greatest error of two touches' distance against that of their crosses, relative, and in cm,
beside what backlash causes: links and prints are wrong by some per cent, and a pen is set by hand.
"""


class BrickPoint(NamedTuple):
    """A point that `driver.py touch --json` has taken.

    p  the tip, (x, y), cm
    q  the joints' angles, rad
    t  when, s on the brick's clock
    """

    p: tuple[float, float]
    q: tuple[float, ...]
    t: float


def read_point(line: str) -> BrickPoint:
    """Read a point from its line of JSON.

    Raises:
        BadTouches: it is none.
    """
    try:
        fields = parse_json(line)
        p, q = (tuple(number(value) for value in fields[key]) for key in ("p", "q"))
        if len(p) != 2 or len(q) != 2:
            raise InvalidFile("is not of an arm in the plane")
        return BrickPoint((p[0], p[1]), q, number(fields["t"]))
    except KeyError as error:
        why = f"has no {error.args[0]}"
    except (InvalidFile, TypeError) as error:
        why = str(error)
    raise BadTouches(
        f"'{printable(line.strip()[:40])}' {printable(why)}: it is no point of driver.py "
        "touch --json"
    )


def check_led(arm: Arm) -> None:
    """Raise BadTouches for an arm that cannot be guided by hand."""
    if arm.chain in PULLED_DOWN:
        raise BadTouches(
            f"{arm.name} is an arm in space: let go it would drop, so it is not led by hand"
        )


class CrossTouching:
    """The touches of one arm on one board.

    Args:
        arm: in the plane.
        calibration: of the camera, by that board.
        sample: samples through that camera, now.
        report: gives people a line.
        again: whether a touch that is no good can be had anew; else its cross is left out.
        chosen: the crosses to touch, from 0 on.

    Raises:
        BadTouches: an arm in space.
    """

    def __init__(
        self,
        arm: Arm,
        calibration: Calibration,
        sample: Callable[[], CrossSample],
        report: Callable[[str], None],
        again: bool = True,
        chosen: Sequence[int] = range(len(CROSSES)),
    ) -> None:
        check_led(arm)
        self._arm, self._calibration, self._sample = arm, calibration, sample
        self._report, self._again = report, again
        self._left = list(chosen)
        self.touches: list[Touch] = []
        self._play: list[float] = []

    @property
    def cross(self) -> int | None:
        """The cross to be touched now, from 0 on; None: there is none left."""
        return self._left[0] if self._left else None

    @property
    def paper(self) -> str:
        """Name of the board's paper."""
        return self._calibration.board.paper

    @property
    def bar(self) -> float | None:
        """Length of its bar that is reckoned with, mm; None: not measured."""
        return self._calibration.bar

    def request(self) -> str:
        """Return the instruction for the next touch."""
        k = self._left[0]
        where = CROSS_NAMES[k]
        return f"set the pen on cross {k + 1} of {len(CROSSES)}, {where} on the sheet, and press"

    def skip(self) -> None:
        """Leave out the cross to be touched now."""
        if self._left:
            self._report(f"cross {self._left.pop(0) + 1} is left out")

    def handle(self, point: BrickPoint) -> bool:
        """Take the point that was touched now; whether it counts.

        Raises:
            BadTouches: the brick has another arm's numbers.
            BadCalibration: the camera or the board has moved: nothing of this counts.
        """
        k = self._left[0]
        tip = kinematics.forward(self._arm, point.q)
        if math.dist(tip, point.p) > MAX_TIP_DIFFERENCE:
            raise BadTouches(
                f"the brick has the tip at {_pair(point.p)} cm, and {self._arm.file} at "
                f"{_pair(tip)}: the brick's file of this arm is another one; put yours there: "
                "brick arm FILE"
            )
        sample = self._sample()
        self.check_camera(sample)
        trouble = sample.why or self._trouble(k, point)
        if trouble and self._again:
            self._report(
                f"{trouble}: cross {k + 1} does not count yet; set it right and press again"
            )
            return False
        self._left.pop(0)
        if trouble:
            self._report(f"{trouble}: cross {k + 1} is left out")
            return False
        assert sample.pixel is not None
        x, y = (float(one) for one in self._calibration.scale * CROSSES[k])
        self.touches.append(Touch((x, y), (tip[0], tip[1]), sum(point.q), sample.pixel))
        self._play.append(_play_sigma(self._arm, point.q))
        u, v = sample.pixel
        self._report(
            f"cross {k + 1}: tip at {_pair(tip)} cm, the arm's marker at {u:.1f},{v:.1f} px"
        )
        return True

    def check_camera(self, sample: CrossSample) -> None:
        """Refuse, by BadCalibration, a camera or board that has moved since it was calibrated."""
        if sample.view is None:
            if sample.pixel is not None:
                raise BadCalibration(
                    "no marker of the board is seen any more: leave the camera where it is, keep "
                    "the board free, and touch all crosses anew"
                )
            return
        shift = shift_since(self._calibration, sample.view)
        if shift.moved:
            raise BadCalibration(f"{shift}, and touch all crosses anew; nothing is written")

    def _trouble(self, k: int, point: BrickPoint) -> str:
        """Return why this is no touch of cross `k` if the others are right; "" if it may be one."""
        for other, play in zip(self.touches, self._play, strict=True):
            distance = math.dist(other.cross, self._calibration.scale * CROSSES[k])
            moved = math.dist(other.tip, point.p)
            # Either tip is up to its play off: of two joints that is some 2.5 sigma.
            most = (
                MAX_PLACE_ERROR
                + MAX_SCALE_ERROR * distance
                + 2.5 * (play + _play_sigma(self._arm, point.q))
            )
            if abs(moved - distance) > most:
                return (
                    f"the pen is {moved:.1f} cm from where it touched the cross "
                    f"{_number_of(other, self._calibration)}, "
                    f"and the two are {distance:.1f} cm apart"
                )
        return ""

    def fit(self, height: float | None = None) -> MarkerFit:
        """Find where the marker sits.

        Args:
            height: of the marker over the paper, cm, if it was measured.

        Raises:
            BadTouches: too few, or they do not fit one another.
        """
        mean = math.sqrt(float(np.mean(np.square(self._play)))) if self._play else 0.0
        return fit_marker(
            self._calibration.camera, self.touches, height, joints=math.hypot(JOINTS_SIGMA, mean)
        )


def _number_of(touch: Touch, calibration: Calibration) -> int:
    off = np.linalg.norm(calibration.scale * CROSSES - touch.cross, axis=1)
    return int(np.argmin(off)) + 1


def _play_sigma(arm: Arm, q: Sequence[float]) -> float:
    """Return the tip's standard deviation, cm: each link lies anywhere within its play."""
    *axes, tip = kinematics.joint_positions(arm, q)
    halves = [
        math.dist(axis, tip) * joint.backlash / 2
        for axis, joint in zip(axes, arm.joints, strict=True)
    ]
    # Of a uniform distribution; and of its two directions each has half of that.
    return math.sqrt(sum(half * half for half in halves) / 3)


def _pair(point: Sequence[float]) -> str:
    return ",".join(f"{value + 0.0:.2f}" for value in point)
