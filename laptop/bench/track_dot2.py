"""ViSP's vpDot2, a tracker of dots for visual servoing, on pictures of the disc's share.

On grey ones it loses most red discs, so it gets the share of disc in each pixel.  `vp_dot2.cpp`
runs it, which is compiled where g++ and ViSP are.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path

import numpy as np

from laptop.bench.track_methods import DOT2
from laptop.bench.track_score import Point
from laptop.see.markers.discriminant import disc_share, fit_discriminant
from shared.arm_description import ArmError

SOURCE = Path(__file__).with_name("vp_dot2.cpp")
"""Source of the program that runs it."""
COMPILER = "g++"
LIBRARIES = ("-lvisp_blob", "-lvisp_core")
STEP_TIMEOUT = 120.0
"""Longest time of compiling, and of following a clip, s; each takes less than a second."""


class NoDot2(ArmError):
    """ViSP's vpDot2 cannot be compiled or run here."""


def follow(shares: Sequence[np.ndarray], places: Sequence[Point]) -> list[Point | None]:
    """Track a blob through a clip by one process; None per picture in which it is lost.

    Args:
        shares: the pictures, uint8, shape (h, w).
        places: where it starts in the first one, and in the one after each loss, px.

    Raises:
        NoDot2: it cannot be compiled, or did not come to the end.
    """
    height, width = shares[0].shape
    clip = [b"%d %d\n" % (width, height)]
    for share, (u, v) in zip(shares, places, strict=True):
        clip += b"%.4f %.4f\n" % (u, v), share.tobytes()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, SOURCE.stem)
        file.write_bytes(program())
        file.chmod(0o700)
        lines = _run([str(file)], b"".join(clip)).splitlines()
    if len(lines) != len(shares):
        raise _left_out(f"it told {len(lines)} places in {len(shares)} pictures")
    found = [line.split() for line in lines]
    return [None if one == ["lost"] else (float(one[0]), float(one[1])) for one in found]


@cache
def program() -> bytes:
    """Return the compiled program as bytes, so that no file stays behind.

    Raises:
        NoDot2: there is no compiler, or no ViSP.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, SOURCE.stem)
        _run([COMPILER, "-O2", "-std=c++17", SOURCE.name, "-o", str(file), *LIBRARIES])
        return file.read_bytes()


def _run(args: list[str], given: bytes = b"") -> str:
    """Run a program beside the source, and return what it prints."""
    try:
        done = subprocess.run(
            args,
            input=given,
            cwd=SOURCE.parent,
            env={**os.environ, "LC_ALL": "C"},
            capture_output=True,
            timeout=STEP_TIMEOUT,
        )
    except (OSError, subprocess.TimeoutExpired) as problem:
        why = getattr(problem, "strerror", None) or f"no end in {STEP_TIMEOUT:g} s"
        raise _left_out(why, args) from None
    if done.returncode:
        lines = done.stderr.decode(errors="replace").splitlines() or [f"status {done.returncode}"]
        errors = (line for line in lines if re.search("error: |cannot find ", line))
        raise _left_out(next(errors, lines[0]), args)
    return done.stdout.decode()


def _left_out(why: str, args: Sequence[str] = (SOURCE.stem,)) -> NoDot2:
    return NoDot2(
        f"{DOT2} is left out, {Path(args[0]).name}: {why}; "
        "on Debian: apt install g++ libvisp-blob-dev"
    )


def shares_of(
    clip: Iterable[tuple[np.ndarray, Point]], radius: float, motion: Point
) -> list[np.ndarray]:
    """Return the share of disc in each pixel, uint8, shape (h, w), 255 for all.

    The discriminant of disc and surroundings is fitted at the true place, in every picture.

    Args:
        clip: pictures, BGR, uint8, and where the disc is, px.
        radius: of the disc, px.
        motion: of it during the exposure, px.
    """
    du, dv = motion
    still = radius**2 / 4
    covariance = still + du * du / 12, still + dv * dv / 12, du * dv / 12
    model, shares = None, []
    for image, (u, v) in clip:
        model = fit_discriminant(image, u, v, radius, covariance) or model
        nothing = np.zeros(image.shape[:2], np.uint16)
        share = nothing if model is None else disc_share(image, model)
        shares.append((share >> 8).astype(np.uint8))
    return shares
