"""Counts of how often and how surely a marker was detected."""

from __future__ import annotations

import math
from collections import Counter

from shared.messages import LEAST_CONFIDENCE


class DetectionStats:
    """Detections of one marker over all frames.

    Attributes:
        seen: number of frames with a detection.
        lost: number of frames without one, by reason.
    """

    def __init__(self) -> None:
        self.seen = 0
        self.lost: Counter[str] = Counter()
        self._confidences = [0] * 101  # a histogram, for there may be millions

    def add(self, confidence: float | None, why: str) -> None:
        """Count one frame.

        Args:
            confidence: 0 .. 1; None: not detected.
            why: the reason then, "" if there is none.
        """
        if confidence is None:
            self.lost[why or "not seen"] += 1
        else:
            self.seen += 1
            self._confidences[min(100, max(0, round(100 * confidence)))] += 1

    @property
    def frames(self) -> int:
        """Number of frames in all."""
        return self.seen + self.lost.total()

    @property
    def reliable(self) -> int:
        """Number of frames with a detection that may be acted upon."""
        return sum(self._confidences[round(100 * LEAST_CONFIDENCE) :])

    @property
    def confidence(self) -> float:
        """Median confidence of the detections; nan without any."""
        counted = 0
        for percent, count in enumerate(self._confidences):
            counted += count
            if counted and 2 * counted >= self.seen:
                return percent / 100
        return math.nan
