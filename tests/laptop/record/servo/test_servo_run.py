"""One run of the servo: by its log, and by the truth, which decides."""

import pytest
from servo_log import GOAL, lines_of, log_text, text_of
from servo_runs import told, truth

from laptop.record.run import DamagedRun
from laptop.record.servo.servo_log import is_log, read_log
from laptop.record.servo.servo_run import goal_text, goals_table

# By its log


def test_a_log_tells_way_errors_joints_and_steps(tmp_path):
    run = told(tmp_path, method="broyden", note="held a while")
    assert (run.method, run.mode, run.tolerance, run.verdict) == ("broyden", "look", 5, "converged")
    assert (run.moves, run.seconds, run.error, run.goal) == (4, 4.5, 2.0, "marker")
    assert run.paths["A"][:, 1].tolist() == [200, 249.5, 299, 348.5, 398]
    assert run.goals == {"A": GOAL}
    assert run.samples["A"].shape == (5, 2)
    assert run.errors.tolist() == [[0, 200], [1, 150.5], [2, 101], [3, 51.5], [4, 2]]
    assert run.components["A.u"][:, 1].tolist() == [-200, -150.5, -101, -51.5, -2]
    assert run.angles["shoulder"][:, 1].tolist() == [0, 0.1, 0.2, pytest.approx(0.3), 0.4]
    assert run.condition.tolist() == [[2, 3.5], [3, 3.5], [4, 3.5]]
    assert run.remarks == [(4.0, "held a while")]
    assert [row[:4] for row in run.steps.rows[:2]] == [
        [0.0, "explore", None, 200.0],
        [1.0, "explore", None, 150.5],
    ]
    assert run.steps.rows[1][4:8] == [5.7, 5.7, 5.7, 5.7]


def test_where_a_camera_was_blind_it_saw_nothing(tmp_path):
    lines = lines_of(log_text(cameras="AB"))
    blind = next(entry for entry in lines if entry["kind"] == "step")
    blind.update(rows=["B.u", "B.v"], s=[1.0, 2.0], goal=[3.0, 4.0])
    seen = dict(next(entry for entry in lines if entry["kind"] == "seen"), camera="B")
    run = told(tmp_path, text=text_of([*lines, seen]))
    assert len(run.samples["A"]) == 4
    assert run.samples["B"][0].tolist() == [1.0, 2.0]


def test_a_log_that_is_cut_off_is_read_up_to_there(tmp_path):
    run = told(tmp_path, text=log_text()[:-20])
    assert (run.verdict, len(run.steps.rows)) == ("", 5)


@pytest.mark.parametrize("text", ["no json\n", "[]\n", '{"t": 1}\n', "7\n"])
def test_what_is_no_log_is_refused_in_one_line(tmp_path, text):
    with pytest.raises(DamagedRun, match=r"^servo.jsonl is no whole log of visual_servoing.py"):
        told(tmp_path, text=text)


def test_a_link_is_no_log(tmp_path):
    (tmp_path / "true.jsonl").write_text(log_text())
    (tmp_path / "link.jsonl").symlink_to(tmp_path / "true.jsonl")
    with pytest.raises(DamagedRun, match="is no whole log"):
        read_log(tmp_path / "link.jsonl")


def test_a_number_beyond_all_that_a_run_measures_is_named(tmp_path):
    with pytest.raises(DamagedRun, match=r"^servo.jsonl holds 1e308, which is beyond all that a"):
        told(tmp_path, text=log_text().replace('"t": 4.0', '"t": 1e308'))


def test_a_log_is_known_by_its_first_line(tmp_path):
    file = tmp_path / "x.jsonl"
    file.write_text(log_text())
    assert is_log(file)
    file.write_text('{"event": "ready"}')
    assert not is_log(file)
    assert not is_log(tmp_path / "none.jsonl")


def test_a_goal_is_told_in_words():
    assert goal_text({"A": [400.0, 200.5]}) == "400, 200.5"
    assert goal_text({"A": [400.0, 200.0], "B": [1, 2]}) == "A: 400, 200; B: 1, 2"
    assert goal_text("marker") == "marker"
    assert goal_text(None) == "the marker"


# By the truth


@pytest.mark.parametrize(
    ("off", "verdict", "reached", "outcome"),
    [
        (7.9, "converged", True, "reached"),
        (8.1, "converged", False, "not reached, though the brick says so"),
        (2.0, "budget spent", True, "reached, though the brick says 'budget spent'"),
        (90.0, "unreachable", False, "not reached: unreachable"),
    ],
)
def test_the_truth_decides_and_not_what_the_brick_says(tmp_path, off, verdict, reached, outcome):
    run = told(tmp_path, 1.0, verdict=verdict, true=truth(off))
    assert run.reached is reached
    assert run.outcome == outcome
    assert f"truly {off:.1f} px ({0.9 * off:.1f} mm) off after 4 moves, 4.5 s" in run.summary


@pytest.mark.parametrize(("off", "reached"), [(9.7, True), (9.8, False)])
def test_in_space_millimetres_decide(tmp_path, off, reached):
    run = told(tmp_path, off, cameras="AB", true=truth(off, "AB"))
    assert run.within_mm == pytest.approx(8.8)  # 1.6 tolerances of 5 px, of 1.1 mm each
    assert run.true_error == pytest.approx(off)
    assert run.reached is reached


def test_the_true_error_ends_with_the_run_and_not_with_the_rest_after_it(tmp_path):
    moved_on = truth(2.0)
    moved_on.path[-1, 1] = 0.0  # after the verdict, at 5 s
    run = told(tmp_path, true=moved_on)
    assert run.errors[-1].tolist() == [4.5, pytest.approx(2.0)]
    assert run.paths["A"].shape[1] == 3


def test_a_camera_that_saw_nothing_has_its_own_true_way_all_the_same(tmp_path):
    lines = lines_of(log_text(cameras="AB"))
    for line in lines:
        if line["kind"] == "seen":
            line["camera"] = "B"
    run = told(tmp_path, text=text_of(lines), true=truth(2.0, "AB"), cameras="AB")
    assert run.paths["A"][0, 1] == GOAL[0] - 200  # which B's line of sight is
    assert set(run.paths["B"][:, 1]) == {GOAL[0]}


def test_without_the_truth_nobody_knows_whether_it_is_there(tmp_path):
    run = told(tmp_path)
    assert (run.true_error, run.reached) == (None, False)
    (row,) = goals_table([("goal", run)]).rows
    assert row[-3:] == [None, None, None]


def test_the_table_of_goals_tells_both(tmp_path):
    (row,) = goals_table([("goal 1", told(tmp_path, true=truth(4.0)))]).rows
    assert row == ["planar", "goal 1", "chain", "converged", 4, 4.5, 2.0, None, 4.0, 3.6, True]
