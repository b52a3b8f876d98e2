"""Places for `track --board`: each camera's, and where there are several, in space."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from laptop.see.serve.joint_track import Joints
from laptop.see.table.arm_pose import ArmPose
from laptop.see.table.board_watch import BoardWatch
from laptop.see.table.camera_fit import check_bar
from laptop.see.table.marker_offset import BadTouches
from laptop.see.table.touch_file import read_touched
from laptop.see.table.two_cameras import TwoCameras
from shared.arm_description import Arm
from shared.messages import EFFECTOR

ReportLine = Callable[[str], None]
Watch = Callable[[Sequence[str], ReportLine, Joints], tuple[list[BoardWatch], TwoCameras | None]]
"""Makes watches of the board from the cameras' names, a logger of lines for people, and the joints.
"""


def watch_tables(bar: float | None, height: float | None, touched: Path | None, arm: Arm) -> Watch:
    """Check the board's options, and return what makes a watch for each camera.

    Args:
        bar: length of the printed bar as measured, mm, or None.
        height: of the arm's marker over the table, mm, or None.
        touched: file of touched crosses, or None.
        arm: that the cameras see.

    Raises:
        ArmError: one line that says what is wrong.
    """
    check_bar(bar)
    arm_pose = ArmPose(read_touched(touched).fit, arm) if touched else None
    if arm_pose and height is not None:
        raise BadTouches(
            f"height {height:g} mm: by the touched crosses it is {10 * arm_pose.height:.1f} mm; "
            "leave --marker-height out"
        )
    heights = {}
    if arm_pose:
        heights = {EFFECTOR: arm_pose.height}
    elif height is not None:
        heights = {EFFECTOR: height / 10}

    def watch(
        names: Sequence[str], report: ReportLine, joints: Joints
    ) -> tuple[list[BoardWatch], TwoCameras | None]:
        alone = len(names) == 1 or height is not None or arm_pose is not None
        watches = [
            BoardWatch(bar, heights, name, report, arm_pose, joints, alone) for name in names
        ]
        if len(names) == 1:
            return watches, None
        return watches, TwoCameras(dict(zip(names, watches, strict=True)), arm, joints, report)

    return watch
