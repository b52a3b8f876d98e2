"""What goes into an arm's file, and what is refused."""

import math
import shutil
from datetime import date
from pathlib import Path

import numpy as np
import pytest
import seen_arms

from laptop.measure.arm.arm_fit import BadIdentification, fit_arm
from laptop.measure.arm.arm_model import MeasuredByHand
from laptop.measure.arm.arm_result import (
    check_scale,
    check_signs,
    check_square,
    measured,
    write_measured,
)
from laptop.see.table.arm_file import ArmNotWritten
from shared.arm_description import find_arm, read_arm

TODAY = date(2026, 11, 25)
ZEROS = (0.01, -0.02)


def fitted(
    arm=seen_arms.ARM, touches=6, square=0, height=2.5, print_scale=1.0, bar=100.0, turn=0.0, **more
):
    table = seen_arms.table(print_scale=print_scale, turn=turn)
    model = seen_arms.model(table, MeasuredByHand(height, square, 0.3), arm, bar=bar)
    hand = table.touches(touches, np.random.default_rng(5), 0.05) if touches else []
    return fit_arm(model, seen_arms.rests(table, 24, ZEROS, noise_px=0.1, **more), hand)


@pytest.fixture(scope="module")
def mine(tmp_path_factory):
    return Path(shutil.copyfile(find_arm("planar"), tmp_path_factory.mktemp("arm") / "mine.ini"))


@pytest.fixture(scope="module")
def fit(mine):
    return fitted(read_arm(mine))


def test_the_file_gets_the_numbers_with_their_uncertainties_and_the_old_one_is_kept(fit, mine):
    before = mine.read_text()
    assert write_measured(fit, measured(fit), TODAY).file == mine
    arm = read_arm(mine)
    true = zip(arm.joints, (11.6, 9.2), (3.0, 1.0), ZEROS, strict=True)
    for joint, link, backlash, zero in true:
        assert joint.link == pytest.approx(link, abs=0.04)
        assert math.degrees(joint.backlash) == pytest.approx(backlash, abs=0.1)
        assert joint.home == pytest.approx(zero, abs=math.radians(0.4))
    assert arm.marker_offset == pytest.approx((0.3, -0.2), abs=0.05)
    assert Path(f"{mine}.bak").read_text() == before
    lines = [
        line for line in mine.read_text().splitlines() if "seen by a camera 2026-11-25" in line
    ]
    assert len(lines) == 7, "two links, two zeros, two backlashes, and the marker"
    sigma = fit.sigma("shoulder.link")
    assert f"; +- {sigma:.2g} cm, seen by a camera 2026-11-25; from the shoulder's" in lines[1]
    assert lines[0].startswith("marker_offset = 0.")
    sigmas = [f"{fit.sigma(f'marker.{key}'):.2g}" for key in ("along", "aside")]
    assert f"; +- {' '.join(sigmas)} cm, seen by a camera 2026-11-25" in lines[0]
    mine.write_text(before)


def test_a_number_that_is_not_known_stays_as_it_was(fit):
    unknown = {row.name: row for row in measured(fitted(touches=0, square=None, height=None))}
    assert "lay the board's edge" in unknown["shoulder: home (its zero)"].why
    assert "touch crosses" in unknown["elbow: link"].why
    assert "touch crosses" in unknown["marker: beyond the pen"].why
    assert not any(row.why for row in measured(fit))


def test_where_nothing_is_known_nothing_is_written(fit, tmp_path):
    with pytest.raises(BadIdentification, match="nothing is known better than before"):
        write_measured(fit, [], TODAY, tmp_path / "new.ini")
    assert list(tmp_path.iterdir()) == []


def test_a_place_that_cannot_be_written_is_told_and_what_to_write(fit, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ArmNotWritten, match=r"is not changed: .*write there: \[shoulder\] link"):
        write_measured(fit, measured(fit), TODAY, tmp_path / "file" / "arm.ini")


def test_a_board_may_lie_turned_by_quarters(fit):
    check_square(fit)
    turned = fitted(touches=0, square=1, turn=-math.pi / 2)  # its x points to the arm's left
    assert turned.value("shoulder.zero") == pytest.approx(ZEROS[0], abs=math.radians(1))
    check_square(turned)


def test_a_board_that_lies_otherwise_than_said_is_refused():
    otherwise = fitted(touches=0, square=3, turn=-math.pi / 2)
    with pytest.raises(BadIdentification, match="--board-square 90 instead of 270 would explain"):
        check_square(otherwise)


@pytest.mark.long
def test_a_wrong_print_looks_like_longer_links_unless_its_bar_was_measured():
    as_described = seen_arms.table().arm
    wrong = fitted(as_described, print_scale=0.97, bar=None)
    with pytest.raises(
        BadIdentification,
        match=r"all links are 3\.\d % longer .* bar is 9[67]\.\d mm long .* give it, --bar",
    ):
        check_scale(wrong, None)
    check_scale(wrong, 100.0)  # somebody says that it was measured
    right = fitted(as_described, print_scale=0.97, bar=97.0)
    check_scale(right, None)
    assert right.value("shoulder.link") == pytest.approx(11.6, abs=0.04)


@pytest.mark.long
def test_a_joint_that_turns_the_other_way_round_is_refused(fit):
    check_signs(fit)
    with pytest.raises(BadIdentification, match="the elbow turns the other way round"):
        check_signs(fitted(touches=0, moved=lambda q: q * (1, -1)))
