"""Runs on the laptop."""

import os
import sys

# OpenCV's settings.  On Windows it keeps the environment as it was when cv2 was imported, which a
# module of any room may do first.
OPENCV = {
    "OPENCV_LOG_LEVEL": "SILENT",  # what OpenCV and FFmpeg say on stderr helps nobody
    "OPENCV_FFMPEG_LOGLEVEL": "-8",
    "OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT": "2",
}
if os.name == "nt":  # else Windows tries for long what may speed up each mode of a webcam
    OPENCV["OPENCV_VIDEOIO_MSMF_ENABLE_HW_TRANSFORMS"] = "0"
for _name, _value in OPENCV.items():
    os.environ.setdefault(_name, _value)

if sys.argv[:1] == ["-m"]:  # `python -m laptop` is being found: no traceback of Ctrl-C from here on
    import _signal  # type: ignore[import-not-found]

    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)
