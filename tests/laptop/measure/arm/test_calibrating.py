"""A picture by which no arm can be measured is refused with the true cause."""

import cv2
import numpy as np
import pytest
import seen_arms

from laptop.measure.arm.arm_fit import BadIdentification
from laptop.measure.arm.calibrating import check_board, check_sharp, seen_board

SHARP = np.full((480, 640, 3), 200, np.uint8)
SHARP[100:300, 150:400] = 30


def test_a_sharp_picture_without_a_board_lacks_the_board():
    check_sharp(SHARP)
    with pytest.raises(BadIdentification, match="no marker of the printed board is seen: lay it"):
        seen_board(SHARP)


@pytest.mark.parametrize("size", [(200, 1), (1, 200), (120, 120)])
def test_a_blurred_picture_is_told_whichever_way_it_is_smeared(size):
    luck = np.random.default_rng(1)
    noisy = cv2.blur(SHARP, size) + luck.normal(0, 3, SHARP.shape)
    with pytest.raises(BadIdentification, match=r"the picture is blurred: no edge .* focus"):
        seen_board(np.clip(noisy, 0, 255).astype(np.uint8))


def test_a_dark_picture_is_told():
    with pytest.raises(BadIdentification, match=r"the picture is nearly even \(2 to 12 of 255\)"):
        seen_board((SHARP // 17 + 1).astype(np.uint8))


def test_a_board_must_be_seen_for_the_most_part():
    for covered, seen in ((0.0, 24), (0.5, 13)):
        view = seen_arms.table()._view((0.0, 0.0), np.random.default_rng(1), covered)
        if covered:
            with pytest.raises(
                BadIdentification, match=r"of the board's 26 markers are seen, and 16"
            ):
                check_board(view)
        else:
            assert len(check_board(view).numbers) >= seen - 2
