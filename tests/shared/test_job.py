"""The job file: what is written is read again, and what is no job is refused in one line."""

import json
import math
import os
import tracemalloc
import zlib

import pytest

import shared.job
from robot.motion import paths, trajectory
from shared.arm_description import find_arm, read_arm
from shared.job import BadJob, Job, Stroke, header_of, write_job

PLANAR = read_arm(find_arm("planar"))
SHAPES = (
    paths.polyline([(10, 0), (8, 4), (5, 10)]),
    paths.circle((10, 5), 2),
)


def planned(arm=PLANAR, shapes=SHAPES):
    strokes = []
    for shape in shapes:
        pieces = [motion.numbers() for motion in trajectory.plan(arm, shape)]
        strokes.append(Stroke("", 5.0, 1.0, pieces))
    return strokes


def written(tmp_path, strokes=None):
    strokes = planned() if strokes is None else strokes
    path = str(tmp_path / "a.job")
    write_job(path, header_of(PLANAR, "two shapes", 12.0, strokes, 3.5, 20.0), strokes)
    return path


def refusal(path, arm=PLANAR):
    with pytest.raises(BadJob) as error:
        read_all(path, arm)
    return str(error.value)


def read_all(path, arm):
    job = Job(path, arm)
    return [job.stroke(k) for k in range(1, job.header.strokes + 1)]


def test_a_job_is_read_as_it_was_written(tmp_path):
    job = Job(written(tmp_path), PLANAR)
    assert job.header.name == "two shapes"
    assert job.header.links == (11.3, 9.5)
    assert job.header.strokes == 2
    assert job.header.cm == 10.0
    for k, shape in enumerate(SHAPES, 1):
        for piece, motion in zip(job.stroke(k).pieces, trajectory.plan(PLANAR, shape)):
            again = trajectory.Trajectory(*piece)
            assert again.duration == pytest.approx(motion.duration, abs=1e-5)
            assert again.reversals[0] == pytest.approx(motion.reversals[0], abs=1e-3)
            for x in range(21):
                t = x / 20.0 * motion.duration
                assert again.at(t)[0] == pytest.approx(motion.at(t)[0], abs=1e-5)
                assert again.speeds(t) == pytest.approx(motion.speeds(t), abs=1e-3)


def test_a_stroke_is_found_by_its_share_of_the_length(tmp_path):
    strokes = [planned()[0]._replace(cm=cm) for cm in (1.0, 4.0, 5.0)]
    job = Job(written(tmp_path, strokes), PLANAR)
    shares = [job.stroke_at(share) for share in (0.0, 0.09, 0.1, 0.3, 0.5, 0.99, 1.0)]
    assert shares == [1, 1, 2, 2, 3, 3, 3]
    assert [job.cm_before(k) for k in (1, 2, 3, 4)] == [0.0, 1.0, 5.0, 10.0]
    with open(job.path, "rb") as file:
        assert [job.size(k) for k in (1, 2, 3)] == [len(line) for line in file][1:4]


def test_a_stroke_whose_length_does_not_stand_first_is_none(tmp_path):
    path = written(tmp_path)
    with open(path, "rb") as file:
        head, *strokes, _ = file.read().splitlines(True)
    strokes = [stroke.replace(b'{"cm":5.0,', b'{"cm":-5.0,', 1) for stroke in strokes]
    crc = zlib.crc32(b"".join([head] + strokes))
    with open(path, "wb") as file:
        file.write(b"".join([head] + strokes + [b'{"crc":%d,"end":2}\n' % crc]))
    assert "does not begin with its length" in refusal(path)


def lines_of(path):
    with open(path) as file:
        return file.read().splitlines()


def test_a_file_that_was_cut_off_or_changed_is_no_job(tmp_path):
    path = written(tmp_path)
    lines = lines_of(path)
    for text, message in (
        ("\n".join(lines[:2]), "is cut off"),
        ("", "does not hold"),
        ("\n".join(lines).replace('"cm":5.0', '"cm":6.0', 1), "was changed on its way"),
        ("\x00" * 100, "does not hold"),
        ("{}\n{}\n", "is cut off"),
    ):
        with open(path, "w") as file:
            file.write(text)
        assert message in refusal(path)
    assert "give a job's file" in refusal(str(tmp_path / "none"))
    assert "is a folder" in refusal(str(tmp_path))


def test_a_job_for_other_links_is_refused(tmp_path):
    other = PLANAR._replace(joints=(PLANAR.joints[0]._replace(link=12.0), PLANAR.joints[1]))
    message = refusal(written(tmp_path), other)
    assert "links 11.3, 9.5 cm" in message
    assert "links 12, 9.5 cm" in message


def changed(stroke, change):
    pieces = json.loads(json.dumps(stroke.pieces))
    change(pieces)
    return stroke._replace(pieces=pieces)


def jump(pieces):
    pieces[0][1][3][2][0][0] += 0.1


def not_a_number(pieces):
    pieces[0][1][0][2][1][2] = math.nan


def back_in_time(pieces):
    pieces[0][0][2] = pieces[0][0][1]


def beyond(pieces):
    for _, segments, end in pieces:
        for segment in segments:
            segment[2][0][0] += 4.0
        end[0] += 4.0


def too_fast(pieces):
    for times, segments, _ in pieces:
        times[:] = [t / 10 for t in times]
        for segment in segments:
            segment[0] *= 10
            segment[1] *= 100


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (jump, "jumps by 5.7 deg"),
        (not_a_number, "holds NaN"),
        (back_in_time, "time does not go on"),
        (beyond, "beyond its limits -90 to 170"),
        (too_fast, "beyond its 180"),
        (lambda pieces: pieces[0][1][0][2].pop(), "another arm"),
        (lambda pieces: pieces.clear(), "without a piece"),
        (lambda pieces: pieces[0][1][0].pop(), "does not hold"),
    ],
    ids=lambda x: getattr(x, "__name__", "")[:12],
)
def test_a_stroke_that_the_arm_cannot_follow_is_refused(tmp_path, change, message):
    strokes = planned()
    strokes[1] = changed(strokes[1], change)
    assert message in refusal(written(tmp_path, strokes))


def test_a_stroke_too_long_for_the_brick_is_not_written(tmp_path):
    stroke = planned()[1]
    strokes = [stroke._replace(pieces=stroke.pieces * 200)]
    with pytest.raises(BadJob, match="lift the pen somewhere"):
        written(tmp_path, strokes)
    assert not list(tmp_path.iterdir())


def test_a_job_takes_the_place_of_a_regular_file_only(tmp_path):
    path = tmp_path / "a.job"
    os.mkfifo(str(path))
    with pytest.raises(BadJob, match=r"a\.job: is a pipe, not a file; choose another name"):
        written(tmp_path)
    assert path.is_fifo()
    assert list(tmp_path.iterdir()) == [path]


def test_a_joint_that_leaves_its_limits_between_two_knots_is_refused(tmp_path):
    shoulder, elbow = ([q, 0.0, 0.0, 0.0] for q in (0.0, 1.0))
    # From 0 to 0 over 10 cm, s (1 - s / 10)^2: by way of 1.5 rad and, steeper, of 3.1.
    for size, refused in ((1.0, False), (2.1, True)):
        bulge = [0.0, size, -0.2 * size, 0.01 * size]
        segments = [(0.0, 0.05, [bulge, elbow], None), (1.0, -0.05, [shoulder, elbow], None)]
        piece = ([0.0, 20.0, 40.0], segments, [0.0, 1.0])
        path = written(tmp_path, [Stroke("", 20.0, 1.0, [piece])])
        if refused:
            assert "stroke 1 needs the shoulder at 178.3 deg, beyond its limits" in refusal(path)
        else:
            assert read_all(path, PLANAR)


def test_a_cubic_that_cannot_be_reckoned_with_is_refused(tmp_path):
    steep, elbow = [0.0, 0.0, 1e200, -1e200], [1.0, 0.0, 0.0, 0.0]
    piece = ([0.0, 1.0], [(1.0, 0.0, [steep, elbow], None)], [0.0, 1.0])
    path = written(tmp_path, [Stroke("", 1.0, 1.0, [piece])])
    assert "has a number beyond all bounds" in refusal(path)


def test_a_piece_that_stands_or_goes_back_is_refused(tmp_path):
    cubics = [[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]]
    for v, a in ((0.0, 0.0), (-1.0, 0.5)):
        piece = ([0.0, 2.0], [(v, a, cubics, None)], [0.0, 1.0])
        path = written(tmp_path, [Stroke("", 20.0, 1.0, [piece])])
        assert "does not go on" in refusal(path)


def one_segment(tmp_path, v, a, dt, shoulder, elbow=(1.5, 0.0, 0.0, 0.0)):
    """A job of one segment, at the tip's speed and acceleration for a time, by two cubics."""
    s = dt * (v + 0.5 * a * dt)
    end = [c0 + s * (c1 + s * (c2 + s * c3)) for c0, c1, c2, c3 in (shoulder, elbow)]
    piece = ([0.0, dt], [(v, a, [list(shoulder), list(elbow)], None)], end)
    return written(tmp_path, [Stroke("", s, 1.0, [piece])])


def test_a_joint_that_is_too_fast_between_two_knots_at_which_it_stands_is_refused(tmp_path):
    turn = math.radians(30)
    for dt, message in (
        (0.2, "needs the shoulder at 225 deg/s, beyond its 180"),
        (0.3, "needs the shoulder accelerated by 2000 deg/s^2, beyond 240"),
        (0.9, ""),
    ):
        path = one_segment(tmp_path, 1 / dt, 0.0, dt, (0.0, 0.0, 3 * turn, -2 * turn))
        if message:
            assert message in refusal(path)
        else:
            read_all(path, PLANAR)


@pytest.mark.parametrize("v", [-10.0, -0.001])
def test_a_piece_that_goes_back_before_it_goes_on_is_refused(tmp_path, v):
    # Both its ends are within the limits, and 20 cm behind its beginning is -150 deg.
    slope = math.radians(4.5)
    path = one_segment(tmp_path, v, 2.53125, 8.0, (-1.05, slope, 0.0, 0.0))
    assert "runs backwards" in refusal(path)


def test_what_turns_back_at_its_very_end_is_looked_at_as_far_as_it_goes(tmp_path):
    # By 0.4 mm, as rounded numbers would have it, at 2 rad/cm: by 4.6 deg.
    v, a, dt = 0.02, -0.001, 29.0
    end = dt * (v + 0.5 * a * dt)
    within, beyond = (math.radians(angle) - 2.0 * end for angle in (165, 169))
    read_all(one_segment(tmp_path, v, a, dt, (within, 2.0, 0.0, 0.0)), PLANAR)
    told = refusal(one_segment(tmp_path, v, a, dt, (beyond, 2.0, 0.0, 0.0)))
    assert "shoulder at 173.6 deg, beyond its limits -90 to 170" in told
    assert "runs backwards" in refusal(one_segment(tmp_path, v, a, 31.0, (0.0, 2.0, 0.0, 0.0)))


def test_many_small_jumps_are_as_bad_as_a_large_one(tmp_path):
    for step, message in ((0.009, "jumps by 1.0 deg"), (1e-6, "")):
        angles = [k * step for k in range(20)]
        segments = [(1.0, 0.0, [[q, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]], None) for q in angles]
        piece = ([0.01 * k for k in range(21)], segments, [angles[-1], 1.0])
        path = written(tmp_path, [Stroke("", 0.2, 1.0, [piece])])
        if message:
            assert message in refusal(path)
        else:
            read_all(path, PLANAR)


def test_a_job_that_takes_longer_than_it_says_is_refused(tmp_path):
    turn = math.radians(20)
    path = one_segment(tmp_path, 1e-7, 0.0, 1e7, (0.0, 0.0, 3 * turn, -2 * turn))
    with pytest.raises(
        BadJob, match="says that it takes 20 s, and by the end of stroke 1 it takes 1000"
    ):
        list(Job(path, PLANAR).strokes())
    strokes = planned()
    write_job(path, header_of(PLANAR, "x", 12.0, strokes, 3.5, 2e6), strokes)
    assert "takes 2000000 s, and 1000000 are the most" in refusal(path)


def put(path, *lines):
    """Write lines as a job's file, with the right end."""
    data = b"".join(lines)
    with open(path, "wb") as file:
        file.write(data + b'{"crc":%d,"end":%d}\n' % (zlib.crc32(data), data.count(b"\n") - 1))


@pytest.mark.parametrize("line", [b"\n", b'{"cm":0,}\n'])
def test_a_file_of_very_many_lines_is_refused_before_it_fills_the_memory(tmp_path, line):
    path = str(tmp_path / "a.job")
    put(path, b"{}\n", line * (15900000 // len(line)))
    tracemalloc.start()
    try:
        message = refusal(path)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert "does not begin with its length" in message or "is longer than a job may be" in message
    assert most < 10e6


def test_a_whole_number_of_very_many_digits_is_not_reckoned_with(tmp_path):
    path = written(tmp_path)
    with open(path, "rb") as file:
        head, stroke, *_ = file.read().splitlines(True)
    head = head.replace(b'"strokes":2', b'"strokes":1')
    put(path, head, stroke.replace(b'"start_s":1.0', b'"start_s":' + b"9" * 500000))
    assert "has a number beyond all bounds" in refusal(path)


def test_names_hold_nothing_that_would_steer_a_terminal(tmp_path):
    path, strokes = str(tmp_path / "a.job"), planned()
    odd = "\x1b]0;x\x07\u202eabc\n"
    strokes[0] = strokes[0]._replace(layer=odd)
    header = header_of(PLANAR, odd, 12.0, strokes, 3.5, 20.0)._replace(arm=odd)
    write_job(path, header, strokes)
    job = Job(path)
    for word in (job.header.name, job.header.arm, job.stroke(1).layer):
        assert word == " ]0;x  abc "


def rewritten(path, change):
    """Change the objects of a job's lines, and give it the right checksum."""
    with open(path, "rb") as file:
        lines = [json.loads(line.decode()) for line in file.read().splitlines()[:-1]]
    change(lines)
    put(path, *[
        json.dumps(line, sort_keys=True, separators=(",", ":")).encode() + b"\n" for line in lines
    ])  # fmt: skip
    return path


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda lines: lines[0].update(job="x" * 90000), "another format than 1"),
        (lambda lines: lines[0].update(links=[9.0] * 50000), "has 50000 links, and 10 are the"),
        (lambda lines: lines[0].update(name=["x"] * 9000), "a name that is no text"),
        (lambda lines: lines[0].update(cm=1e7), "has 1e+07 cm to go, and 1e+06 are the most"),
        (lambda lines: lines[1].update(cm=1e300), "1e+300 cm of strokes, and 1e+06 are the most"),
        (lambda lines: lines[1].update(start_s=-5), "a stroke that begins after -5 s"),
        (lambda lines: lines[2].update(start_s=1.7e308), "a stroke that begins after 1.7e+308 s"),
        (lambda lines: lines[2].update(stroke="x" * 90000), "another stroke where 2 should be"),
        (lambda lines: lines[1].update(layer=7), "a name that is no text"),
    ],
)
def test_a_number_or_a_name_that_no_job_has_is_refused_in_a_line(tmp_path, change, message):
    problem = refusal(rewritten(written(tmp_path), change))
    assert message in problem
    assert len(problem) < 300 + len(str(tmp_path))


def test_a_checksum_that_is_no_whole_number_is_none(tmp_path):
    path = written(tmp_path)
    with open(path, "rb") as file:
        *lines, end = file.read().splitlines(True)
    with open(path, "wb") as file:
        file.write(b"".join(lines) + end.replace(b',"end"', b'.0,"end"'))
    assert "was changed on its way" in refusal(path)


def test_names_of_any_length_are_cut_and_take_no_room(tmp_path):
    strokes = [stroke._replace(layer="\x1bx" * 400000) for stroke in planned()]
    path = written(tmp_path, strokes)
    assert os.path.getsize(path) < 100000
    assert read_all(path, PLANAR)[0].layer == " x" * 30
    rewritten(path, lambda lines: lines[1].update(layer="\x1b" + "x" * 500000))
    assert read_all(path, PLANAR)[0].layer == " " + "x" * 59


def test_a_job_that_the_brick_has_no_room_for_is_not_written(tmp_path, monkeypatch):
    monkeypatch.setattr("shared.job.MAX_SIZE", 50000)
    strokes = planned() * 10
    with pytest.raises(BadJob, match="more than 0.05 MB, which the brick has no room for; draw a"):
        written(tmp_path, strokes)
    assert not list(tmp_path.iterdir())


def test_very_many_short_pieces_take_the_time_that_the_arm_stands_between_them(tmp_path):
    q = [[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]]
    piece = ([0.0, 1e-7], [(1.0, 0.0, q, None)], [1.0, 1.0])
    path = written(tmp_path, [Stroke("", 0.2, 1.0, [piece] * 4000)])
    with pytest.raises(BadJob, match="says that it takes 20 s, and by the end of stroke 1 it take"):
        list(Job(path, PLANAR).strokes())


@pytest.mark.parametrize("v", [1e-200, 5e-324, 1e-8])
def test_a_segment_that_is_no_way_is_refused(tmp_path, v):
    still = [[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]]
    piece = ([0.0, 0.05], [(v, 0.0, still, None)], [1.0, 1.0])
    assert "does not go on" in refusal(written(tmp_path, [Stroke("", 0.2, 1.0, [piece])]))


def test_a_stroke_that_was_found_fit_is_checked_again_only_if_it_has_changed(tmp_path, monkeypatch):
    path = written(tmp_path)
    job, checked = Job(path, PLANAR), []
    check = shared.job.check_joints
    monkeypatch.setattr("shared.job.check_joints", lambda *args: checked.append(check(*args)))
    first, second = job.strokes()
    assert len(checked) == 2
    again = job.stroke(2)
    assert len(checked) == 2
    assert json.dumps(again) == json.dumps(second)
    with open(path, "r+b") as file:
        text = file.read()
        file.seek(0)
        file.write(text.replace(b'"stroke":2', b'"stroke":3'))
    with pytest.raises(BadJob, match="another stroke where 2 should be"):
        job.stroke(2)
