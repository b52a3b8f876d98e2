"""The figures of servo runs: one set, whoever tells of a run."""

from pathlib import Path

import numpy as np
import pytest
from servo_log import GOAL
from servo_runs import PLACE, told, truth
from small_figures import png_of

from laptop.record.figures import charts, sheet
from laptop.record.run import Ending, Run
from laptop.record.servo import figures
from laptop.record.servo.figures import Scenery
from laptop.record.servo.servo_files import add_servo
from laptop.record.servo.servo_run import ServoRun


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch):
    monkeypatch.setattr(figures, "png_of", png_of)


def a_run(tmp_path, off=2.0, cameras="A", name="goal 1", **words):
    run = told(tmp_path, off, cameras=cameras, true=truth(off, cameras), **words)
    run.name = name
    return run


def drawn_in(monkeypatch, draw, *words):
    """The axes of a picture."""
    drawn = []
    monkeypatch.setattr(figures, "png_of", lambda figure: drawn.append(figure) or b"")
    draw(*words)
    return drawn[0].axes


def lines_of(axes, colour):
    return [line for line in axes.lines if line.get_color() == colour]


IMAGE = np.full((48, 64, 3), 180, np.uint8)
INK = [np.array([[12, y, 8, 20 + y, 30, 40, 30 + y] for y in (-6, 6)])]


def test_each_camera_shows_the_way_that_it_saw(tmp_path, monkeypatch):
    run = a_run(tmp_path, 1.0, "AB")
    run.paths["B"] = truth(1.0, "AB").path[:, [0, 3, 4]]
    scenery = Scenery({"A": IMAGE, "B": IMAGE}, (64, 48), INK)
    *views, _ = drawn_in(monkeypatch, figures.draw_cameras, [run], scenery)
    assert len(views) == 2
    ways = [lines_of(axes, charts.GOAL_COLOURS[0])[0].get_xdata() for axes in views]
    assert (ways[0][0], ways[0][-1]) == (GOAL[0] - 200, GOAL[0] - 1)
    assert set(ways[1]) == {GOAL[0]}  # from there it moved along the line of sight
    inks = [lines_of(axes, sheet.QUIET)[0].get_xydata().tolist() for axes in views]
    assert inks == [[[14, 30], [26, 30]], [[40, 24], [40, 36]]]  # in the air


def test_without_a_picture_the_way_is_drawn_on_axes_of_pixels(tmp_path, monkeypatch):
    axes, _ = drawn_in(monkeypatch, figures.draw_cameras, [a_run(tmp_path)], Scenery())
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    assert left < GOAL[0] - 200 < GOAL[0] < right
    assert top < GOAL[1] < bottom  # v counts downwards
    assert not axes.images


def test_the_way_in_space_is_shown_askew_from_above_and_from_the_side(tmp_path, monkeypatch):
    run = a_run(tmp_path, 1.0, "AB")
    askew, above, side, _ = drawn_in(monkeypatch, figures.draw_space, [run], Scenery())
    assert askew.name == "3d"
    for axes, height in ((above, PLACE[1]), (side, PLACE[2])):
        way = lines_of(axes, charts.GOAL_COLOURS[0])[0]
        assert way.get_xdata()[-1] == pytest.approx(PLACE[0] - 0.09)
        assert set(way.get_ydata()) == {height}
        (ring,) = [patch for patch in axes.patches if patch.get_edgecolor()[:3] != (1, 1, 1)]
        assert ring.radius == pytest.approx(0.88)


def test_there_is_no_way_in_space_of_an_arm_in_the_plane(tmp_path):
    assert figures.draw_space([a_run(tmp_path)], Scenery()) is None


def test_beside_the_errors_are_those_of_the_baseline_or_their_components(tmp_path, monkeypatch):
    run, slow = a_run(tmp_path), a_run(tmp_path, 4.0, method="report")
    _, both = drawn_in(monkeypatch, figures.draw_errors, [run], slow)
    assert both.get_title("left") == "Goal 1, both methods"
    _, apart = drawn_in(monkeypatch, figures.draw_errors, [run])
    curve = lines_of(apart, sheet.JOINTS[0])[0]
    assert curve.get_ydata().tolist() == run.components["A.u"][:, 1].tolist()


def test_several_goals_have_a_panel_of_joints_each_and_very_many_share_one(tmp_path, monkeypatch):
    runs = [a_run(tmp_path, name=f"goal {k}") for k in range(1, 6)]
    assert len(drawn_in(monkeypatch, figures.draw_joints, runs[:3])) == 3 + 1
    assert len(drawn_in(monkeypatch, figures.draw_joints, runs)) == 1 + 1


@pytest.mark.long
@pytest.mark.parametrize("cameras", ["A", "AB"])
def test_no_error_at_all_is_drawn_without_a_warning(tmp_path, recwarn, cameras):
    drawn = figures.draw([a_run(tmp_path, 0.0, cameras)], Scenery())
    names = [name for name, _, _ in drawn]
    assert names == ["cameras", *["space"] * (cameras == "AB"), "errors", "joints"]
    assert all(picture.startswith(b"\x89PNG") for _, _, picture in drawn)
    assert [str(warning.message) for warning in recwarn] == []


def test_of_a_run_of_which_nothing_is_known_there_is_no_figure():
    assert figures.draw([ServoRun("goal", "the marker")], Scenery()) == []


def test_a_record_gets_goals_steps_figures_and_the_true_path(tmp_path):
    record = Run(kind="servo", what="", ending=Ending(0, ""))
    runs = [a_run(tmp_path), a_run(tmp_path, 3.0, name="goal 2")]
    slow = a_run(tmp_path, 4.0, method="report")
    files = add_servo(record, runs, Scenery(), slow)
    assert [*files] == [
        *("cameras.png", "errors.png", "joints.png"),
        *("goal-1-true-path.csv", "goal-2-true-path.csv", "compared-true-path.csv"),
    ]
    assert record.methods == ["chain", "report"]
    assert [table.name for table in record.tables] == ["goals", "steps", "steps", "steps"]
    goals = [row["goal"] for row in record.rows("goals")]
    assert goals == ["goal 1", "goal 2", "goal 1, for comparison"]
    for name, (write, holds) in files.items():
        assert holds
        write(str(tmp_path / name))
    lines = Path(tmp_path / "goal-1-true-path.csv").read_text().splitlines()
    assert lines[:2] == ["t_s,A.u_px,A.v_px", "0.0,200.0,300.0"]
