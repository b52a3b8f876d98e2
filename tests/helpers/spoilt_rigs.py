"""Emulated arms before cameras with which something is wrong from some time on."""

import cv2
import numpy as np

from laptop.emulator.scene.synthetic_camera import SyntheticCamera
from laptop.measure.emulated_rig import EmulatedRig
from laptop.measure.run_data import Sights


def spoilt_rig(links=None, sight=None):
    """A class like EmulatedRig, with which something is wrong.

    Args:
        links: what becomes of the true angles q (n, joints), rad, at times t (n,), s, since the
            first job began.
        sight: what becomes of the pixels (n, 2) then.
    """

    class SpoiltRig(EmulatedRig):
        before = 0.0

        def _see(self, name, t, q):
            now = self.before + t
            self.before += t[-1]
            seen = super()._see(name, t, q if links is None else links(q, now))
            return Sights(t, seen.pixels if sight is None else sight(seen.pixels, now))

    return SpoiltRig


def slipped(joint, angle, at):
    """A joint whose link turns on its axle, by an angle, rad, at a time, s."""
    return lambda q, t: q + np.outer(t > at, np.eye(q.shape[1])[joint]) * angle


def loose(joint, angle, seed=0):
    """A link that stands anywhere within an angle, rad, to each side, anew each few seconds."""
    luck = np.random.default_rng(seed).uniform(-angle, angle, 1000)
    return lambda q, t: q + np.outer(luck[(t / 2.5).astype(int)], np.eye(q.shape[1])[joint])


def moved(px, at):
    """A camera that is pushed, so that all is seen elsewhere, (2,) px, from a time on, s."""
    return lambda pixels, t: pixels + np.outer(t > at, px)


def hidden(rows):
    """A picture of which all below a row is hidden."""
    return lambda pixels, t: np.where(pixels[:, 1:] > rows, np.nan, pixels)


def unseen(pixels, t):
    """A marker that is not found, such as one smeared over 200 px."""
    return np.full_like(pixels, np.nan)


def spoil_pictures(monkeypatch, spoil, first=0):
    """Let rendered pictures, from one on, be what `spoil` makes of them, BGR uint8."""
    capture, count = SyntheticCamera.capture, iter(range(10**9))

    def spoilt(camera, index):
        frame = capture(camera, index)
        image = spoil(frame.image) if next(count) >= first else frame.image
        return frame._replace(image=image)

    monkeypatch.setattr(SyntheticCamera, "capture", spoilt)


def smeared(image, px=200):
    """A picture taken by a camera that was swung meanwhile."""
    return cv2.blur(image, (px, 1))


def half_covered(image):
    """A sheet of paper lies over the upper half of the picture."""
    image = image.copy()
    image[: len(image) // 2] = 230
    return image


def pushed(image, px=40):
    """What a camera sees that was pushed."""
    return np.roll(image, px, axis=1)


def without_red(image):
    """Nothing that is red: the disc is hidden, or has fallen off."""
    image = image.copy()
    image[..., 2] = image[..., :2].max(axis=2)
    return image
