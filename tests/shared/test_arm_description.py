"""The arm files that come along, and one line for every way in which a file can be wrong."""

import math
import os
import re

import pytest

from shared.arm_description import (
    ARMS_FOLDER,
    JOINT_ACCELERATION,
    MOTOR_ACCELERATION,
    Arm,
    ArmError,
    BadArmFile,
    Pen,
    find_arm,
    is_bundled,
    joint_accelerations,
    read_arm,
)

GOOD = """\
[arm]
chain = planar
elbow = up
speed = 11

[shoulder]
link = 11.3
port = A
motor = large
gear = 1
direction = 1
lower = -90
upper = 170
stop_lower = -100
stop_upper = 180
backlash = 2
max_speed = 180
home = 0
find_home = both

[elbow]
link = 9.5
port = B
motor = large
gear = 1
direction = 1
lower = -150
upper = 150
stop_lower = -160
stop_upper = 160
backlash = 2
max_speed = 180
home = 0
find_home = both

[pen]
port = C
motor = medium
up = 0
down = 60
"""


def written(tmp_path, text):
    path = tmp_path / "mine.ini"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
    return str(path)


def changed(section, key, line):
    """GOOD with the line of this key replaced; line None takes it out."""
    head, body = GOOD.split("[" + section + "]\n")
    body = re.sub(rf"(?m)^{key} = .*\n", line + "\n" if line else "", body, count=1)
    return head + "[" + section + "]\n" + body


def test_planar_comes_along():
    arm = read_arm(find_arm("planar"))
    assert (arm.name, arm.chain, arm.elbow) == ("planar", "planar", "up")
    shoulder, elbow = arm.joints
    assert (shoulder.name, shoulder.link, shoulder.port, shoulder.motor) == (
        "shoulder",
        11.3,
        "A",
        "large",
    )
    assert (elbow.name, elbow.link, elbow.port, elbow.motor) == ("elbow", 9.5, "B", "large")
    assert (shoulder.gear, shoulder.direction, shoulder.find_home) == (1, 1, "here")
    in_degrees = [
        math.degrees(angle)
        for angle in (
            shoulder.lower,
            shoulder.upper,
            shoulder.stop_lower,
            shoulder.stop_upper,
            shoulder.backlash,
            shoulder.max_speed,
            shoulder.home,
        )
    ]
    assert in_degrees == pytest.approx([-90, 170, -100, 180, 2, 180, 0])
    assert [
        math.degrees(a) for a in (elbow.lower, elbow.upper, elbow.stop_lower, elbow.stop_upper)
    ] == pytest.approx([-150, 150, -160, 160])
    assert arm.pen == Pen("C", "medium", 0.0, pytest.approx(math.radians(60)))


def test_geared_is_planar_behind_a_reversing_gear():
    planar, geared = read_arm(find_arm("planar")), read_arm(find_arm("geared"))
    for direct, joint in zip(planar.joints, geared.joints):
        assert (joint.gear, joint.direction) == (5, -1)
        assert math.degrees(joint.max_speed) == pytest.approx(60)
        assert joint._replace(gear=1, direction=1, max_speed=direct.max_speed) == direct
    assert geared.pen == planar.pen


@pytest.mark.parametrize("name", ["planar", "planar.ini"])
def test_a_bare_name_is_an_arm_that_comes_along(name):
    assert find_arm(name) == os.path.join(ARMS_FOLDER, "planar.ini")


def test_an_existing_file_goes_before_an_arm_that_comes_along(tmp_path, monkeypatch):
    (tmp_path / "planar.ini").write_text(GOOD)
    monkeypatch.chdir(tmp_path)
    assert find_arm("planar.ini") == "planar.ini"
    assert find_arm(str(tmp_path / "planar.ini")) == str(tmp_path / "planar.ini")


def test_arms_of_ones_own_are_found_by_name_and_come_first(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    (tmp_path / "arms").mkdir()
    for name in ("mine", "planar"):
        (tmp_path / "arms" / (name + ".ini")).write_text("")
    assert find_arm("mine") == str(tmp_path / "arms" / "mine.ini")
    assert find_arm("planar.ini") == str(tmp_path / "arms" / "planar.ini")
    assert find_arm("geared") == os.path.join(ARMS_FOLDER, "geared.ini")
    with pytest.raises(BadArmFile, match="known name: geared, mine, planar, spatial"):
        find_arm("other")


@pytest.mark.parametrize("find", [find_arm, read_arm])
@pytest.mark.parametrize("name", ["nowhere", "no/planar.ini", ""])
def test_a_missing_file_lists_the_arms_that_come_along(find, name):
    with pytest.raises(BadArmFile, match="no such arm file.*geared, planar, spatial$") as caught:
        find(name)
    assert str(caught.value).startswith(name + ":")


def test_everything_is_frozen(tmp_path):
    arm = read_arm(written(tmp_path, GOOD))
    assert isinstance(arm, Arm)
    for value, field in ((arm, "joints"), (arm.joints[0], "link"), (arm.pen, "up")):
        with pytest.raises(AttributeError):
            setattr(value, field, 1)


@pytest.mark.parametrize(
    ("text", "check"),
    [
        pytest.param(GOOD.split("[pen]")[0], lambda arm: arm.pen is None, id="no pen"),
        pytest.param("\ufeff" + GOOD, lambda arm: arm.name == "mine", id="byte order mark"),
        pytest.param(GOOD.replace("\n", "\r\n"), lambda arm: arm.elbow == "up", id="Windows lines"),
        pytest.param(
            GOOD.replace("gear = 1", "gear = 3  ; = 24 : 8"),
            lambda arm: arm.joints[0].gear == 3,
            id="comment with ;",
        ),
        pytest.param(
            GOOD.replace("gear = 1", "gear = 3  # 50 % slower"),
            lambda arm: arm.joints[0].gear == 3,
            id="comment with #",
        ),
        pytest.param(
            changed("elbow", "direction", "direction = +1"),
            lambda arm: arm.joints[1].direction == 1,
            id="plus one",
        ),
        pytest.param(
            changed("elbow", "stop_upper", "stop_upper = none").replace(
                "find_home = both\n\n[pen]", "find_home = lower\n\n[pen]"
            ),
            lambda arm: arm.joints[1].stop_upper is None,
            id="one stop",
        ),
        pytest.param(
            changed("shoulder", "max_speed", "max_speed = 1050"),
            lambda arm: True,
            id="as fast as the motor",
        ),
        pytest.param(
            changed("shoulder", "lower", "lower = -100"), lambda arm: True, id="up to a stop"
        ),
        pytest.param(
            changed("elbow", "backlash", "backlash = 0"),
            lambda arm: arm.joints[1].backlash == 0,
            id="least value",
        ),
        pytest.param(
            changed("elbow", "backlash", "backlash = 20"),
            lambda arm: arm.joints[1].backlash == math.radians(20),
            id="greatest value",
        ),
        pytest.param(GOOD, lambda arm: arm.marker_offset == (0, 0), id="marker on the pen"),
        pytest.param(
            GOOD.replace("[arm]", "[arm]\nmarker_offset = 0.35 -0.2"),
            lambda arm: arm.marker_offset == (0.35, -0.2),
            id="marker beside the pen",
        ),
        pytest.param(
            GOOD.replace("[arm]", "[arm]\nmarker_offset = -1,20"),
            lambda arm: arm.marker_offset == (-1, 20),
            id="marker beside the pen, with a comma",
        ),
    ],
)
def test_what_a_file_may_say(tmp_path, text, check):
    assert check(read_arm(written(tmp_path, text)))


SHOULDER = "[shoulder] "
MALFORMED = [
    (
        "not a number",
        changed("shoulder", "gear", "gear = five"),
        SHOULDER + "gear = five: must be a number from 0.1 to 100",
    ),
    (
        "decimal comma",
        changed("shoulder", "link", "link = 11,3"),
        SHOULDER + "link = 11,3: must be a number from 1 to 100",
    ),
    (
        "negative gear",
        changed("shoulder", "gear", "gear = -3"),
        SHOULDER + "gear = -3: must be a number from 0.1 to 100",
    ),
    (
        "zero link",
        changed("elbow", "link", "link = 0"),
        "[elbow] link = 0: must be a number from 1",
    ),
    (
        "NaN",
        changed("shoulder", "upper", "upper = nan"),
        SHOULDER + "upper = nan: must be a number from -360 to 360",
    ),
    (
        "infinity",
        changed("shoulder", "max_speed", "max_speed = inf"),
        SHOULDER + "max_speed = inf: must be a number from 1 to",
    ),
    ("no value", changed("shoulder", "gear", "gear ="), SHOULDER + "gear = : must be a number"),
    ("only a comment", changed("shoulder", "gear", "gear = ; five"), "gear = : must be a number"),
    (
        "negative backlash",
        changed("elbow", "backlash", "backlash = -1"),
        "[elbow] backlash = -1: must be a number from 0 to 20",
    ),
    (
        "great backlash",
        changed("elbow", "backlash", "backlash = 21"),
        "[elbow] backlash = 21: must be a number from 0 to 20",
    ),
    (
        "direction",
        changed("elbow", "direction", "direction = 2"),
        "[elbow] direction = 2: must be one of 1, +1, -1",
    ),
    (
        "port letter",
        changed("elbow", "port", "port = E"),
        "[elbow] port = E: must be one of A, B, C, D",
    ),
    (
        "port twice",
        changed("elbow", "port", "port = A"),
        "[elbow] port = A: is taken by [shoulder]; each motor needs a port of its own, A to D",
    ),
    ("port of the pen", changed("pen", "port", "port = B"), "[pen] port = B: is taken by [elbow]"),
    (
        "motor",
        changed("elbow", "motor", "motor = huge"),
        "[elbow] motor = huge: must be one of large, medium",
    ),
    (
        "find_home",
        changed("elbow", "find_home", "find_home = left"),
        "[elbow] find_home = left: must be one of both, lower, upper, here, or touch and the",
    ),
    (
        "chain",
        changed("arm", "chain", "chain = snake"),
        "[arm] chain = snake: must be one of planar",
    ),
    (
        "speed",
        changed("arm", "speed", "speed = 0"),
        "[arm] speed = 0: must be a number from 0.1 to 50",
    ),
    (
        "branch",
        changed("arm", "elbow", "elbow = left"),
        "[arm] elbow = left: must be one of up, down",
    ),
    (
        "limits the wrong way round",
        changed("shoulder", "lower", "lower = 171"),
        SHOULDER + "lower = 171: must be below upper = 170",
    ),
    ("limits equal", changed("shoulder", "lower", "lower = 170"), "must be below upper = 170"),
    (
        "lower beyond its stop",
        changed("shoulder", "lower", "lower = -101"),
        SHOULDER + "lower = -101: must not be beyond the hard stop, stop_lower = -100",
    ),
    (
        "upper beyond its stop",
        changed("shoulder", "upper", "upper = 181"),
        SHOULDER + "upper = 181: must not be beyond the hard stop, stop_upper = 180",
    ),
    (
        "home below the limits",
        changed("shoulder", "home", "home = -91"),
        SHOULDER + "home = -91: must be within the limits, from -90 to 170",
    ),
    (
        "home above the limits",
        changed("shoulder", "home", "home = 171"),
        "home = 171: must be within",
    ),
    (
        "stop that is not there",
        changed("shoulder", "stop_upper", "stop_upper = none"),
        SHOULDER + "find_home = both: touches a stop that is not there, stop_upper = none;"
        " without it use lower or here",
    ),
    (
        "stop to seek that is not there",
        changed("elbow", "stop_upper", "stop_upper = none\nseek = upper").replace(
            "find_home = both", "find_home = here"
        ),
        "[elbow] seek = upper: touches a stop that is not there, stop_upper = none;"
        " without it use lower",
    ),
    (
        "touch sensor at no port",
        changed("elbow", "find_home", "find_home = touch"),
        "[elbow] find_home = touch: must be one of both, lower, upper, here, or touch and the "
        "sensor's port, like touch in1",
    ),
    (
        "touch sensor without its angle",
        changed("elbow", "find_home", "find_home = touch in1"),
        "[elbow] find_home = touch in1: give the angle at which the sensor closes, too",
    ),
    (
        "touch sensor within the limits",
        changed("elbow", "find_home", "find_home = touch in1\ntouch_at = 149"),
        "[elbow] touch_at = 149: must be at a limit or up to 15 beyond it: lower = -150, ",
    ),
    (
        "touch sensor far beyond the limits",
        changed("elbow", "find_home", "find_home = touch in1\ntouch_at = 166"),
        "[elbow] touch_at = 166: must be at a limit or up to 15 beyond it",
    ),
    (
        "angle of no touch sensor",
        changed("elbow", "find_home", "find_home = both\ntouch_at = 155"),
        "[elbow] touch_at = 155: is of a touch sensor; give its port, too",
    ),
    (
        "stop neither angle nor none",
        changed("shoulder", "stop_upper", "stop_upper = no"),
        SHOULDER + "stop_upper = no: must be a number from -360 to 360, or none",
    ),
    (
        "faster than the motor",
        changed("shoulder", "gear", "gear = 10"),
        SHOULDER + "max_speed = 180: must be a number from 1 to 105 for this motor with gear = 10",
    ),
    (
        "pen does not move",
        changed("pen", "down", "down = 0"),
        "[pen] down = 0: must differ from up",
    ),
    (
        "missing key",
        changed("elbow", "backlash", None),
        "[elbow] backlash: is missing; it must be a number from 0 to 20",
    ),
    ("missing key of the pen", changed("pen", "up", None), "[pen] up: is missing"),
    ("missing section", GOOD.split("[elbow]")[0], "[elbow] is missing; needed are the keys link, "),
    ("empty file", "", "[arm] is missing; needed are the keys chain, elbow"),
    (
        "unknown key",
        changed("elbow", "gear", "gear = 1\ngaer = 2"),
        "[elbow] gaer = 2: is an unknown key; known here: link, port, motor, gear,",
    ),
    *(
        (
            "marker offset " + given,
            GOOD.replace("[arm]", "[arm]\nmarker_offset = " + given),
            "[arm] marker_offset = " + given + ": must be two numbers from -20 to 20, like 0.3",
        )
        for given in ("0.3", "1 2 3", "1 21", "nan 0", "left right")
    ),
    (
        "unknown section",
        GOOD.replace("[pen]", "[pan]"),
        "[pan] is an unknown section; known here: arm, shoulder, elbow, pen",
    ),
    ("defaults", "[DEFAULT]\ngear = 2\n" + GOOD, "[DEFAULT] is an unknown section"),
    (
        "key twice",
        changed("elbow", "gear", "gear = 1\ngear = 2"),
        "[elbow] gear: is there twice (line 26)",
    ),
    ("section twice", GOOD + "[elbow]\n", "[elbow] is there twice (line 41)"),
    (
        "value over two lines",
        changed("elbow", "gear", "gear = 1\n  2"),
        "[elbow] gear = 1\\n2: must be a number",
    ),
    ("long value", changed("elbow", "gear", "gear = " + "9" * 5000), "[elbow] gear = 999"),
    ("before any section", "gear = 1\n", "line 1 is outside any [section]"),
    ("not INI", "[arm]\nhello\n", "line 2 is not of the form key = value"),
    ("JSON", '{"link": 11.3}\n', "line 1 is outside any [section]"),
    ("zero bytes", b"\0\0\0\0", "line 1 is outside any [section]"),
    ("a picture", b"\x89PNG\r\n\x1a\n\xff\xd8", "is not a text file (UTF-8)"),
    ("UTF-16", GOOD.encode("utf-16"), "is not a text file (UTF-8)"),
]


@pytest.mark.parametrize(
    ("text", "expected"), [case[1:] for case in MALFORMED], ids=[case[0] for case in MALFORMED]
)
def test_a_malformed_file_is_refused_in_one_line(tmp_path, monkeypatch, text, expected):
    assert text != GOOD
    written(tmp_path, text)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadArmFile) as caught:
        read_arm("mine.ini")
    message = str(caught.value)
    assert expected in message
    assert message.startswith("mine.ini: ")
    assert message.endswith("; correct the file")
    assert len(message.splitlines()) == 1
    assert len(message) < 300


def test_a_bad_file_is_an_arm_error_and_a_value_error():
    assert issubclass(BadArmFile, ArmError)
    assert issubclass(BadArmFile, ValueError)


def test_a_folder_is_no_arm_file(tmp_path):
    with pytest.raises(BadArmFile, match="is a folder, not a file; correct the file"):
        read_arm(str(tmp_path))


def test_a_file_below_the_working_folder_is_named_from_there(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path, "")
    with pytest.raises(BadArmFile, match="^mine.ini: "):
        read_arm(path)


# What weighs


def spatial(tmp_path, *edits):
    """The arm in space that comes along, with some of its text replaced in its first place."""
    with open(find_arm("spatial"), encoding="utf-8") as file:
        text = file.read()
    for before, after in edits:
        assert before in text
        text = text.replace(before, after, 1)
    return written(tmp_path, text)


def test_the_arm_in_space_says_what_it_weighs_and_where_it_rests():
    base, shoulder, elbow = read_arm(find_arm("spatial")).joints
    assert (base.mass, base.centre, base.friction, base.park_angle) == (0, 0, 0, None)
    assert (shoulder.mass, shoulder.centre, shoulder.friction) == pytest.approx((0.106, 5.5, 0.01))
    assert (elbow.mass, elbow.centre, elbow.friction) == pytest.approx((0.056, 5.3, 0.01))
    assert [math.degrees(joint.park_angle) for joint in (shoulder, elbow)] == pytest.approx(
        [-15, -30]
    )


def test_without_any_of_it_the_arm_weighs_nothing_and_rests_nowhere(tmp_path):
    with open(find_arm("spatial"), encoding="utf-8") as file:
        text = re.sub(r"(?m)^(mass|centre|friction|rest) = .*\n", "", file.read())
    for joint in read_arm(written(tmp_path, text)).joints:
        assert (joint.mass, joint.centre, joint.friction, joint.park_angle) == (0, 0, 0, None)


@pytest.mark.parametrize(
    ("before", "after", "reason"),
    [
        ("mass = 106", "mass = 0", ["[shoulder]", "mass = 0", "from 1 to 2000"]),
        ("mass = 106", "mass = heavy", ["[shoulder]", "mass = heavy", "from 1 to 2000"]),
        ("centre = 5.5", "centre = -1", ["[shoulder]", "centre = -1"]),
        ("centre = 5.3", ";", ["[elbow]", "only a part", "mass, centre, friction"]),
        ("mass = 56", ";", ["[elbow]", "only a part", "mass, centre, friction"]),
        ("friction = 1 ", "friction = nan ", ["[shoulder]", "friction = nan"]),
        ("rest = -15", "rest = -30", ["[shoulder]", "rest = -30", "from -20 to 130"]),
        ("rest = -15", "rest = low", ["[shoulder]", "rest = low"]),
    ],
)
def test_a_weight_that_is_wrong_is_refused_in_one_line(tmp_path, before, after, reason):
    with pytest.raises(BadArmFile) as error:
        read_arm(spatial(tmp_path, (before, after)))
    assert "\n" not in str(error.value)
    for word in reason:
        assert word in str(error.value)


@pytest.mark.parametrize("line", ["mass = 100", "rest = 0"])
def test_an_arm_in_the_plane_is_not_weighed(tmp_path, line):
    with pytest.raises(BadArmFile, match="unknown key"):
        read_arm(written(tmp_path, GOOD.replace("[elbow]\n", "[elbow]\n" + line + "\n")))


@pytest.mark.parametrize(
    ("line", "method", "port", "at", "seek"),
    [
        (None, "here", None, None, "both"),
        ("find_home = here", "here", None, None, "both"),
        ("find_home = lower", "lower", None, None, "lower"),
        ("find_home = here\nseek = upper", "here", None, None, "upper"),
        ("find_home = touch in4\ntouch_at = -165", "touch", "in4", -165, "both"),
        ("find_home = touch in1\ntouch_at = 150", "touch", "in1", 150, "both"),
    ],
)
def test_how_the_zero_is_found(tmp_path, line, method, port, at, seek):
    file = tmp_path / "mine.ini"
    file.write_text(changed("elbow", "find_home", line))
    elbow = read_arm(str(file)).joints[1]
    assert (elbow.find_home, elbow.touch_port, elbow.seek) == (method, port, seek)
    assert elbow.touch_at == (at and pytest.approx(math.radians(at)))


def test_ones_own_arm_of_a_name_comes_before_that_which_comes_along(tmp_path, monkeypatch):
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path))
    (tmp_path / "arms").mkdir()
    own = tmp_path / "arms" / "planar.ini"
    own.write_text(GOOD)
    assert find_arm("planar") == find_arm("planar.ini") == str(own)
    assert not is_bundled(read_arm(find_arm("planar")))
    assert is_bundled(read_arm(find_arm("geared")))
    with pytest.raises(BadArmFile):
        find_arm("../arms/planar")


def test_a_last_joint_is_accelerated_harder_as_far_as_its_motor_goes():
    """The same friction holds less inertia there: by the square of the reach."""
    joints = read_arm(find_arm("planar")).joints
    usual, last = joint_accelerations(joints)
    assert usual == JOINT_ACCELERATION
    assert last == pytest.approx(usual * (20.8 / 9.5) ** 2)
    assert joint_accelerations(joints[:1]) == [usual]
    *others, last = joint_accelerations(read_arm(find_arm("spatial")).joints)
    assert others == [usual, usual]
    assert last > 4 * usual
    _, last = joint_accelerations(read_arm(find_arm("geared")).joints)
    assert last == pytest.approx(MOTOR_ACCELERATION / 5)
    slow = (joints[0], joints[1]._replace(gear=40.0))
    assert joint_accelerations(slow) == [usual, usual]
