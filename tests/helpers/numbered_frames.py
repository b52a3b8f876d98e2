"""Frames that tell their number, and a video of them."""

import struct

import cv2
import numpy as np
from waiting import PATIENCE

FPS = 20.0
STEP = 12  # of brightness from frame to frame


def picture(number, size=(64, 48)):
    """A picture that tells its number."""
    return np.full((size[1], size[0], 3), 10 + STEP * number, np.uint8)


def number_of(image):
    return round((float(image.mean()) - 10) / STEP)


def write_film(path, pictures, codec="MJPG", fps=FPS):
    """A film of any pictures; its path."""
    first, *others = pictures
    out = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), fps, first.shape[1::-1])
    for image in (first, *others):
        out.write(image)
    out.release()
    return path


def write_video(folder, frames=10, fps=FPS, name="film.avi"):
    return write_film(folder / name, map(picture, range(frames)), fps=fps)


def everything(source):
    """Every frame of a camera that ends."""
    frames = []
    while not source.ended:
        frame = source.read(PATIENCE)
        if frame is not None:
            frames.append(frame)
    return frames


def lengthen(path, factor):
    """Let a Matroska file say that it lasts longer, as with sound or a pace that changes."""
    data = bytearray(path.read_bytes())
    at = data.index(b"\x44\x89\x88") + 3
    (lasts,) = struct.unpack(">d", data[at : at + 8])
    data[at : at + 8] = struct.pack(">d", factor * lasts)
    path.write_bytes(bytes(data))
    return path
