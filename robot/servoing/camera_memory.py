"""What runs of an arm have seen, by camera: in a file, for the next run to begin with.

Key-frames are kept, joint angles and the place in the picture, and no camera's numbers: so whatever
is fitted to them, with whichever links, may change. They hold as long as camera, marker and zero
stay, which the next run's first frames tell (see chain_model).
"""

import os

from shared.config_files import InvalidFile, number, read_json, write_whole

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Callable, Dict, List, Mapping, Sequence  # noqa: F401

    from robot.servoing.chain_model import KeyFrame  # noqa: F401
    from shared.arm_description import Arm  # noqa: F401

VERSION = 1
"""Version of the file's format."""

DECIMALS = 4
"""Decimals of what is stored, in rad, px and px^2."""


class CameraMemory(object):
    """The memory of one arm's cameras.

    Args:
        arm: shared.arm_description.Arm; each name has its own file.
        folder: of the file.
        say: called with a line for people about a file that is of no use.

    Attributes:
        file: path of the file.
    """

    def __init__(self, arm, folder, say):
        # type: (Arm, str, Callable[[str], object]) -> None
        self.file = os.path.join(folder, arm.name + ".cameras")
        self._joints, self._say = len(arm.joints), say

    def load(self):
        # type: () -> Dict[str, List[KeyFrame]]
        """Return {camera: [(q, s, variance)]}, rad, px and px^2; {} if nothing is known."""
        try:
            stored = read_json(self.file)
            if stored["version"] != VERSION:
                raise InvalidFile("is of another version")
            return {camera: self._frames(rows) for camera, rows in stored["cameras"].items()}
        except FileNotFoundError:
            return {}
        except OSError as error:
            problem = "cannot be read ({})".format(error.strerror)
        except InvalidFile as error:
            problem = str(error)
        except (AttributeError, KeyError, TypeError):
            problem = "lacks something"
        self._say("{} {}, so it is not used: the arm explores".format(self.file, problem))
        return {}

    def _frames(self, rows):
        # type: (Sequence[Sequence[float]]) -> List[KeyFrame]
        """Return the key-frames in a camera's rows."""
        n = self._joints
        frames = []  # type: List[KeyFrame]
        for row in rows:
            values = [number(value) for value in row]
            if len(values) != n + 3 or values[-1] <= 0:
                raise InvalidFile("is of another arm")
            frames.append((values[:n], values[n:-1], values[-1]))
        if not frames:
            raise InvalidFile("lacks something")
        return frames

    def save(self, views):
        # type: (Mapping[str, Sequence[KeyFrame]]) -> None
        """Store what `load` returns, of these cameras; where that fails, say so."""
        import json  # not above: not every run stores something

        cameras = {
            camera: [
                [round(value, DECIMALS) for value in list(q) + list(s) + [variance]]
                for q, s, variance in views[camera]
            ]
            for camera in views
        }
        try:
            write_whole(self.file, json.dumps({"version": VERSION, "cameras": cameras}) + "\n")
        except OSError as error:
            self._say(
                "cannot write {}: {}; make room, else the next run explores".format(
                    self.file, error.strerror
                )
            )
