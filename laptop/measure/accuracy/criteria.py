"""Accuracy and repeatability of poses and paths after ISO 9283:1998.  Pure.

Values are the attained positions of one pose, one row a cycle; or, of a path, where each cycle
crossed one plane across it.  All functions take leading axes for several of these at once.
Lengths in are cm, characteristics out are mm.
"""

from __future__ import annotations

import numpy as np

MM = 10.0
"""mm per cm."""
REPEATABILITY_SIGMAS = 3.0
"""Standard deviations that a repeatability spans, as the standard has it."""
MIN_CYCLES = 3
"""Fewest cycles: of two both distances from the mean are equal, so their spread would be zero."""
MIN_VARIANCE = 1e-12
"""Variance below which a direction counts as exact, cm^2: (1e-5 mm)^2."""


def pose_accuracy(values: np.ndarray, commanded: np.ndarray) -> np.ndarray:
    """AP: distance of the barycentre from the commanded position, mm.

    Args:
        values: (..., cycles, d), cm.
        commanded: (..., d), cm.
    """
    off = values.mean(axis=-2) - commanded
    return np.asarray(MM * np.linalg.norm(off, axis=-1))


def pose_repeatability(values: np.ndarray) -> np.ndarray:
    """RP: mean distance from the barycentre and three of its standard deviations, mm.

    Args:
        values: (..., cycles, d), cm.
    """
    distances = np.linalg.norm(values - values.mean(axis=-2, keepdims=True), axis=-1)
    return np.asarray(
        MM * (distances.mean(axis=-1) + REPEATABILITY_SIGMAS * distances.std(axis=-1, ddof=1))
    )


def direction_variation(barycentres: np.ndarray) -> np.ndarray:
    """VAP: greatest distance between what one pose is from several directions, mm.

    Args:
        barycentres: (..., directions, d), cm.
    """
    distance = barycentres[..., :, None, :] - barycentres[..., None, :, :]
    return np.asarray(MM * np.linalg.norm(distance, axis=-1).max(axis=(-2, -1)))


def distance_accuracy(
    one: np.ndarray, other: np.ndarray, commanded: float
) -> tuple[np.ndarray, np.ndarray]:
    """AD and RD of the distance of two poses, mm.

    AD is how far the mean distance is from the commanded one, RD three standard deviations of it.

    Args:
        one: attained positions of a pose, (..., cycles, d), cm.
        other: of another one in the same cycles.
        commanded: cm.
    """
    distances = np.linalg.norm(one - other, axis=-1)
    return (
        np.asarray(MM * np.abs(distances.mean(axis=-1) - commanded)),
        np.asarray(MM * REPEATABILITY_SIGMAS * distances.std(axis=-1, ddof=1)),
    )


def path_accuracy(crossings: np.ndarray) -> np.ndarray:
    """AT: greatest distance of the barycentre from the path, over all planes, mm.

    Args:
        crossings: (..., planes, cycles, d), cm across the path; the path itself is at 0.
    """
    return np.asarray(pose_accuracy(crossings, np.zeros(crossings.shape[-1])).max(axis=-1))


def path_repeatability(crossings: np.ndarray) -> np.ndarray:
    """RT: the greatest of all planes' repeatability, mm; arguments as for path_accuracy."""
    return np.asarray(pose_repeatability(crossings).max(axis=-1))


def without_noise(values: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Shrink values about their mean until they spread as they would without the camera's noise.

    Their covariance C becomes C - N, with N the noise's; where N is greater, nothing is left.  The
    deviations are mapped by C^(1/2) (1 - C^(-1/2) N C^(-1/2))^(1/2) C^(-1/2).

    Args:
        values: (..., cycles, d), cm.
        noise: covariance of one value, (..., d, d), cm^2.
    """
    mean = values.mean(axis=-2, keepdims=True)
    off = values - mean
    covariance = np.swapaxes(off, -1, -2) @ off / (values.shape[-2] - 1)
    size, axes = np.linalg.eigh(covariance)
    root = np.sqrt(np.maximum(size, 0.0))
    back = np.where(size > MIN_VARIANCE, 1 / np.sqrt(np.maximum(size, MIN_VARIANCE)), 0.0)
    turned = np.swapaxes(axes, -1, -2)
    white = (axes * back[..., None, :]) @ turned
    share, sides = np.linalg.eigh(white @ noise @ white)
    left = (sides * np.sqrt(np.clip(1 - share, 0.0, 1.0))[..., None, :]) @ np.swapaxes(
        sides, -1, -2
    )
    shrink = (axes * root[..., None, :]) @ turned @ left @ white
    return np.asarray(mean + off @ np.swapaxes(shrink, -1, -2))
