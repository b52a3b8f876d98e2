"""The brick's LCD: a framebuffer that a script maps and writes."""

import os
import tempfile
from typing import Any, Optional

from laptop.emulator.device.attribute_devices import invalid

MYPY = False
if MYPY:
    from typing import IO  # noqa: F401


WIDTH, HEIGHT = 178, 128
"""Size of the screen, px."""

_FBIOGET_VSCREENINFO = 0x4600
_FBIOGET_FSCREENINFO = 0x4602


class Screen(object):
    """The framebuffer, 32 bit per pixel."""

    def __init__(self) -> None:
        self._file = None  # type: Optional[IO[bytes]]
        self._pixels = None  # type: Optional[bytes]

    def open(self) -> int:
        """Return a descriptor of the framebuffer, to be mapped; the caller closes it."""
        if self._file is None:
            self._file = tempfile.TemporaryFile()  # noqa: SIM115 `close` closes it
            self._file.truncate(4 * WIDTH * HEIGHT)
        return os.dup(self._file.fileno())

    def pixels(self) -> Optional[bytes]:
        """Return the graphics as bytes of grey, row by row; None when it was never opened."""
        if self._file is not None:
            self._file.seek(0)
            self._pixels = self._file.read()[1::4]
        return self._pixels

    def close(self) -> None:
        """Keep the pixels and let go of the framebuffer."""
        self.pixels()
        if self._file is not None:
            self._file.close()
            self._file = None

    def ioctl(self, request: int, argument: Any) -> None:
        """Answer an ioctl on the framebuffer."""
        if request == _FBIOGET_FSCREENINFO:
            argument.id_name = b"ST7586"
            argument.smem_len = 4 * WIDTH * HEIGHT
            argument.line_length = 4 * WIDTH
        elif request == _FBIOGET_VSCREENINFO:
            argument.xres = argument.xres_virtual = WIDTH
            argument.yres = argument.yres_virtual = HEIGHT
            argument.bits_per_pixel = 32
        else:
            raise invalid()
