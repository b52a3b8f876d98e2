"""Messages: what goes in comes out, and nothing else gets in."""

import json

import pytest

from shared.arm_description import ArmError
from shared.framing import TAG_LENGTH, LineBuffer
from shared.job_messages import (
    MAX_PARTS,
    ORDERS,
    PART_SIZE,
    STATES,
    Draw,
    InvalidOrder,
    JobPart,
    JobStatus,
    Order,
    Want,
    bytes_of,
    check_order,
    part_of,
)
from shared.message_fields import MAX_JOINTS, MAX_TEXT, one_line
from shared.messages import (
    BRICK,
    MAX_CAMERAS,
    MAX_LINE,
    MAX_MARKERS,
    VERSION,
    BadMessage,
    Bye,
    Challenge,
    Hello,
    Observation,
    Ping,
    Pong,
    Proof,
    Refused,
    Start,
    Status,
    Stop,
    Welcome,
    decode,
    encode,
)

SEEN = Observation(7, "A", 12.5, {"effector": (320.125, 240.5, 0.98), "goal": None})
MESSAGES = [
    Hello(VERSION, BRICK, "0" * 32),
    Challenge("f" * 32, "5" * 32),
    Proof("a" * 64),
    Welcome("b" * 64),
    Refused("busy", "the tracker serves 192.168.0.7", 1.5),
    Ping(3),
    Pong(3, 1.25, 1.5),
    SEEN,
    Observation(0, "top-left_2", 0.0, {}),
    Status(99.5, (0.1, -3.2), 12.25, ""),
    Status(99.5, (), None, "marker lost"),
    Status(99.5, (0.1,), 5.0, "limit", "the elbow", {"A.u": 3.0, "A.v": -4.0}, 17.5, 12, 3),
    Status(99.5, (), None, "", battery=7.42),
    Start(),
    Start("report", "stream", "xyz", 2.5, 120.0, True, {"A": (400.5, 200.0), "B": (-3.0, 9.25)}),
    Stop("the button on the page"),
    Draw("a rose", 123456, 40, 0xCAFE0123),
    Draw("", 1, 1, 0, 7, True, True),
    Want(0xCAFE0123, 39),
    JobPart(0xCAFE0123, 39, "aGVsbG8="),
    JobPart(1, 3, "CQ=="),  # a job's last part may be one byte
    JobPart(1, 3, "CQk="),
    Order("pause", None),
    Order("speed", 50.0),
    JobStatus(9.5, 7, "a rose", "drawing", 3, 37, 12.25, 412.5, 99.5, True, ""),
    JobStatus(9.5, 7, "", "failed", 0, 0, 0.0, 0.0, None, False, "the elbow is blocked"),
    Bye(""),
]


def line(**changes):
    """The line of an observation as another program might write it, with some values changed."""
    values = {
        "kind": '"observation"',
        "camera": '"A"',
        "seq": "7",
        "t": "12.5",
        "markers": '{"effector": [1.0, 2.0, 0.5]}',
    }
    values.update(changes)
    body = ", ".join('"{}": {}'.format(*item) for item in values.items() if item[1] is not None)
    return ("{" + body + "}\n").encode("utf-8", "surrogatepass")


def refused(data):
    """Why these bytes are refused; it must be one printable line of bearable length."""
    with pytest.raises(BadMessage) as error:
        decode(data)
    text = str(error.value)
    assert isinstance(error.value, ArmError)
    assert text.isprintable()
    assert len(text) < 250
    return text


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_what_is_encoded_is_decoded(message):
    data = encode(message)
    assert data.endswith(b"\n")
    assert data.count(b"\n") == 1
    again = decode(data)
    assert type(again) is type(message)
    assert again == message


@pytest.mark.parametrize(
    "changes",
    [
        {}, {"markers": "{}"}, {"markers": '{"effector": null, "goal": [1.5, -2.0, 1.0]}'},
        {"t": "12"}, {"markers": '{"effector": [1, 2, 1]}'}, {"seq": "9007199254740992"},
        {"seq": "-1"}, {"seq": "7.0"}, {"seq": "true"}, {"t": "-1.0"}, {"t": "1e10"},
        {"t": "null"}, {"camera": "7"}, {"camera": '"A b"'}, {"markers": "[]"},
        {"markers": '{"effector": [1.0, 2.0]}'}, {"markers": '{"effector": [1.0, 2.0, 1.5]}'},
        {"markers": '{"effector": [1e6, 2.0, 0.5]}'}, {"markers": '{"effector": [1.0, 2.0, "1"]}'},
        {"markers": '{"effector": "1.0"}'}, {"markers": '{"effector": true}'},
    ],
    ids=str,
)  # fmt: skip
def test_an_observation_is_read_alike_whether_its_names_are_new_or_known(changes):
    """What is heard 30 times a second takes a short way through the checks, not another one."""

    def read(usual):
        try:
            return decode(line(**changes), usual)
        except BadMessage as error:
            return str(error)

    assert read({"A", "effector", "goal"}) == read(set())


def test_no_message_passes_for_none():
    assert all(MESSAGES)


def test_numbers_are_rounded_to_what_is_measurable():
    data = encode(Observation(1, "A", 12.3456789, {"goal": (1.23456, 2, 0.98765)}))
    assert decode(data) == Observation(1, "A", 12.345679, {"goal": (1.235, 2.0, 0.988)})


@pytest.mark.parametrize(
    "message",
    [
        Observation(
            2 ** 53, "c" * 16, 1e9 - 0.123457,
            {f"{n:x<32}": (-99999.123, -99999.123, 0.123) for n in range(MAX_MARKERS)},
        ),
        Status(
            1e9 - 0.123457, (-999.123457,) * MAX_JOINTS, 999999.123, "x" * 32,
            "\U0001d11e" * MAX_TEXT,
            {f"{n:x<16}.u": -999999.123 for n in range(2 * MAX_CAMERAS)},
            1e12 - 0.123, 2**53, 2**53, 99.99,
        ),
        Start(
            "x" * 16, "x" * 16, "x" * 16, 199.999, 3599.999, False,
            {f"{n:x<16}": (-99999.123, -99999.123) for n in range(MAX_CAMERAS)},
        ),
        Refused("x" * 16, "\U0001d11e" * MAX_TEXT, 3599.999),
        part_of(bytes(range(256)) * 6, 2**32 - 1, 0),
        JobPart(2**32 - 1, MAX_PARTS - 1, "+" * 1900),
        JobStatus(
            1e9 - 0.123457, 2**32 - 1, "\U0001d11e" * 60, "fetching", 16000000, 16000000,
            999999.12, 999999.12, 999999.1, False, "\U0001d11e" * MAX_TEXT,
        ),
    ],
    ids=lambda message: type(message).__name__,
)  # fmt: skip
def test_the_longest_message_fits_into_a_line(message):
    assert len(encode(message)) <= MAX_LINE
    assert decode(encode(message)) == message


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"t": "NaN"}, "NaN is not a number"),
        ({"t": "Infinity"}, "Infinity is not a number"),
        ({"t": "-Infinity"}, "-Infinity is not a number"),
        ({"t": "1e999"}, "t is inf; it must be a number from 0 to 1e+09 s"),
        ({"t": "-0.5"}, "t is -0.5; it must be"),
        ({"t": "1" + "0" * 400}, "t is 1000"),
        ({"t": "true"}, "t is True; it must be a number"),
        ({"t": "null"}, "t is None"),
        ({"t": '"12.5"'}, "t is '12.5'"),
        ({"t": "[12.5]"}, "t is a list of 1"),
        ({"t": None}, "t is missing"),
        ({"seq": "7.0"}, "seq is 7.0; it must be a whole number"),
        ({"seq": "true"}, "seq is True"),
        ({"seq": "-1"}, "seq is -1"),
        ({"seq": "9007199254740993"}, "seq is 9007199254740993"),
        ({"camera": '""'}, "camera is ''"),
        ({"camera": '"A\\n"'}, "camera is"),
        ({"camera": '"' + "A" * 17 + '"'}, "camera is"),
        ({"camera": "65"}, "camera is 65"),
        ({"markers": "[]"}, "markers is a list of 0; it must be a table of at most 16"),
        ({"markers": "null"}, "markers is None"),
        ({"markers": '{"a b": null}'}, "1 to 32 of A-Z a-z 0-9 _ -"),
        ({"markers": '{"\\ud800": null}'}, "1 to 32 of A-Z a-z 0-9 _ -"),
        ({"markers": '{"goal": [1, 2]}'}, "u, v and confidence"),
        ({"markers": '{"goal": [1, 2, 0.5, 3]}'}, "u, v and confidence"),
        ({"markers": '{"goal": false}'}, "u, v and confidence"),
        ({"markers": '{"goal": "abc"}'}, "u, v and confidence"),
        ({"markers": '{"goal": [1, null, 0.5]}'}, "a number from -100000 to 100000 px"),
        ({"markers": '{"goal": [1, 1e6, 0.5]}'}, "a number from -100000 to 100000 px"),
        ({"markers": '{"goal": [1, 2, 1.5]}'}, "a number from 0 to 1"),
        ({"markers": '{"goal": [1, 2, true]}'}, "a number from 0 to 1"),
        ({"kind": '"observations"'}, "there is no kind of message 'observations'"),
        ({"kind": "[]"}, "there is no kind of message a list"),
        ({"kind": None}, "there is no kind of message None"),
        ({"kind": '"\\ud800"'}, "there is no kind of message '\\ud800'"),
    ],
    ids=str,
)  # fmt: skip
def test_a_wrong_value_is_refused_in_one_line_that_says_what_is_allowed(changes, reason):
    assert reason in refused(line(**changes))


def test_too_many_markers_or_joints():
    markers = ", ".join(f'"m{number}": null' for number in range(MAX_MARKERS + 1))
    assert "at most 16" in refused(line(markers="{" + markers + "}"))
    angles = ", ".join(["0"] * (MAX_JOINTS + 1))
    status = '{"kind":"status","t":1,"error":null,"verdict":"","q":[' + angles + "]}"
    assert "at most 8 angles" in refused(status.encode())


def changed(message, **changes):
    """The line of a message with some values changed; ... leaves one out."""
    values = json.loads(encode(message).decode())
    values.update(changes)
    stored = {key: value for key, value in values.items() if value is not ...}
    return json.dumps(stored).encode()


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"method": ...}, "method is missing"),
        ({"method": "Chain"}, "method is 'Chain'; it must be 1 to 16 of a-z -"),
        ({"mode": 7}, "mode is 7"),
        ({"rows": ""}, "rows is ''"),
        ({"tolerance": 0}, "tolerance is 0; it must be a number from 0.5 to 200 px"),
        ({"tolerance": 201}, "tolerance is 201; it must be"),
        ({"tolerance": "5"}, "tolerance is '5'; it must be"),
        ({"budget": 0.5}, "budget is 0.5; it must be a number from 1 to 3600 s"),
        ({"budget": 1e9}, "budget is 1000000000.0; it must be"),
        ({"follow": 1}, "follow is 1; it must be true or false"),
        ({"goals": []}, "goals is a list of 0; it must be a table of at most 8 goals"),
        ({"goals": {f"c{n}": [1, 2] for n in range(9)}}, "a table of at most 8 goals"),
        ({"goals": {"A B": [1, 2]}}, "1 to 16 of A-Z a-z 0-9 _ -"),
        ({"goals": {"A": [1]}}, "u and v for each camera"),
        ({"goals": {"A": "12"}}, "u and v for each camera"),
        ({"goals": {"A": [1, 1e6]}}, "a number from -100000 to 100000 px"),
    ],
    ids=str,
)
def test_orders_that_no_laptop_may_give_are_refused(changes, reason):
    assert reason in refused(changed(Start(), **changes))


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"verdict": "x" * 33}, "at most 32 of a-z and spaces"),
        ({"verdict": "<b>"}, "at most 32 of a-z and spaces"),
        ({"reason": "x" * (MAX_TEXT + 1)}, "at most 200 printable characters"),
        ({"reason": "two\nlines"}, "at most 200 printable characters"),
        ({"e": [1, 2]}, "a table of at most 16 rows"),
        ({"e": {f"c{n}.u": 1 for n in range(17)}}, "a table of at most 16 rows"),
        ({"e": {"A": 1}}, "a camera's name and .u or .v"),
        ({"e": {"A.u": None}}, "a number from -1e+06 to 1e+06 px"),
        ({"condition": 1e13}, "a number from 0 to 1e+12"),
        ({"moves": -1}, "moves is -1; it must be a whole number"),
        ({"run": ...}, "run is missing"),
        ({"run": 1.5}, "run is 1.5; it must be a whole number"),
        ({"battery": -1}, "a number from 0 to 100 V"),
    ],
    ids=str,
)
def test_a_status_that_no_brick_may_send_is_refused(changes, reason):
    assert reason in refused(changed(Status(1.0, (), None, ""), **changes))


@pytest.mark.parametrize(
    ("message", "changes", "reason"),
    [
        (Draw("a", 1, 1, 1), {"name": "x" * 61}, "at most 60 printable characters"),
        (Draw("a", 1, 1, 1), {"name": "two\nlines"}, "printable characters"),
        (Draw("a", 1, 1, 1), {"size": 16000001}, "a whole number from 1 to 16000000"),
        (Draw("a", 1, 1, 1), {"parts": 0}, "parts is 0; it must be a whole number from 1"),
        (Draw("a", 1, 1, 1), {"crc": 2**32}, "crc is 4294967296"),
        (Draw("a", 1, 1, 1), {"first": 0}, "first is 0; it must be"),
        (Draw("a", 1, 1, 1), {"alone": 1}, "alone is 1; it must be true or false"),
        (Want(1, 0), {"part": MAX_PARTS}, f"part is {MAX_PARTS}; it must be"),
        (JobPart(1, 0, "aaaa"), {"data": "aa a"}, "at most 1900 letters of base64"),
        (JobPart(1, 0, "aaaa"), {"data": "aaaaa"}, "must be base64"),
        (JobPart(1, 0, "aaaa"), {"data": ""}, "letters of base64"),
        (JobPart(1, 0, "aaaa"), {"data": "a" * 1904}, "letters of base64"),
        (JobPart(1, 0, "aaaa"), {"data": ["aaaa"]}, "letters of base64"),
        (Order("pause", None), {"what": "dance"}, "one of pause, resume, abort, speed, pen"),
        (Order("pause", None), {"what": ["pause"]}, "one of pause, resume"),
        (Order("speed", 1.0), {"value": 1e9}, "a number from -1000 to 1000"),
    ],
    ids=str,
)  # fmt: skip
def test_what_nobody_may_say_of_a_job_is_refused(message, changes, reason):
    assert reason in refused(changed(message, **changes))


def test_progress_that_cannot_be_is_refused():
    progress = MESSAGES[-2]
    for key, value in (
        ("state", "dancing"), ("stroke", -1), ("cm", -0.5), ("seconds", -1), ("down", None),
        ("t", float(10**10)), ("reason", "x" * (MAX_TEXT + 1)),
    ):  # fmt: skip
        assert f"progress: {key} is" in refused(changed(progress, **{key: value})), key
    assert {decode(changed(progress, state=state)).state for state in STATES} == set(STATES)


def test_the_parts_of_a_job_are_the_job():
    packed = bytes(range(256)) * 20
    count = -(-len(packed) // PART_SIZE)
    parts = [decode(encode(part_of(packed, 7, k))) for k in range(count)]
    assert b"".join(bytes_of(part) for part in parts) == packed
    assert [part.part for part in parts] == list(range(count))


@pytest.mark.parametrize(
    ("order", "reason"),
    [
        (Order("speed", None), "speed None: give a number from 25 to 100 %$"),
        (Order("speed", 101.0), "speed 101.0: give a number from 25 to 100 %$"),
        (Order("pen", 31.0), "pen 31.0: give a number from -30 to 30 deg"),
    ],
)
def test_an_order_that_makes_no_sense_is_refused(order, reason):
    with pytest.raises(InvalidOrder, match=reason):
        check_order(order)


def test_orders_that_make_sense_are_taken():
    for what in ORDERS:
        check_order(Order(what, {"speed": 25.0, "pen": -30.0}.get(what)))


def test_a_status_of_a_brick_that_knows_no_battery_is_understood():
    status = Status(1.0, (0.5,), 3.0, "", battery=7.4)
    assert decode(changed(status, battery=...)) == status._replace(battery=None)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", ""),
        ("as it is", "as it is"),
        ("two\nlines\x1b[2J \ud800", "two lines [2J  "),
        ("x" * MAX_TEXT, "x" * MAX_TEXT),
        ("x" * (MAX_TEXT + 1), "x" * (MAX_TEXT - 3) + "..."),
    ],
    ids=ascii,
)
def test_any_text_becomes_one_that_a_message_takes(text, line):
    assert one_line(text) == line
    encode(Stop(line))


@pytest.mark.parametrize(
    "text", ["\x1b[2J", "two\nlines", "\ud800", "x" * (MAX_TEXT + 1), "\u202eevil"], ids=ascii
)
def test_a_text_that_would_steer_a_terminal_is_refused(text):
    data = b'{"kind":"stop","reason":' + json.dumps(text).encode() + b"}"
    assert "printable characters" in refused(data)
    with pytest.raises(BadMessage):
        encode(Stop(text))


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\n",
        b"hello",
        b"GET / HTTP/1.1\r",
        b"\xff\xfe{}",
        b"\xed\xa0\x80",
        b'{"kind":"start"',
        b'{"kind":"start"}{"kind":"start"}',
        b"\xef\xbb\xbf" + b'{"kind":"start"}',
        b"[" * MAX_LINE,
        b'{"a":' * 400,
        b'{"kind":"bye","reason":"","x":' + b"[" * 900 + b"]" * 900 + b"}  ",
    ],
    ids=lambda data: repr(data[:20]),
)
def test_garbage_is_refused(data):
    try:
        decode(data)
    except BadMessage:
        refused(data)
    else:
        assert data.endswith(b"}  ")  # nested as deep as it may be, in a key that is not looked at


def test_a_value_nested_deeply_is_refused_without_looking_at_all_of_it():
    """Showing it would go as deep as reading it did, and it is shown from further down."""
    assert "t is a list of 1" in refused(line(t="[" * 300 + "]" * 300))


@pytest.mark.parametrize("data", [b"[]", b"7", b'"start"', b"null", b"true"])
def test_json_that_is_no_object_is_refused(data):
    assert "a line is an object" in refused(data)


def test_a_long_line_is_refused_unread():
    assert "at most 2048" in refused(b" " * (MAX_LINE + 2))
    assert decode(encode(Start()).strip().ljust(MAX_LINE) + b"\n") == Start()


def test_unknown_keys_are_ignored():
    assert decode(line(size="[640, 480]")).seq == 7


def test_a_hello_of_another_version_is_understood_whatever_else_it_says():
    assert decode(b'{"kind":"hello","version":0}').version == 0
    assert decode(b'{"kind":"hello","version":9,"role":7,"nonce":[]}').version == 9
    assert "nonce is missing" in refused(b'{"kind":"hello","version":%d,"role":"brick"}' % VERSION)
    assert "version is True" in refused(b'{"kind":"hello","version":true}')


@pytest.mark.parametrize(
    "message",
    [
        SEEN._replace(t=float("nan")),
        SEEN._replace(t=float("inf")),
        SEEN._replace(markers={"goal": (float("nan"), 0, 1)}),
        SEEN._replace(markers={"goal": (0, 0, 1.01)}),
        SEEN._replace(seq=7.5),
        SEEN._replace(camera="front camera"),
        Status(1.0, (float("nan"),), None, ""),
        Refused("busy", "", 1e9),
    ],
    ids=str,
)
def test_what_the_other_side_would_refuse_is_not_sent(message):
    with pytest.raises(BadMessage):
        encode(message)


# The line buffer


def test_lines_come_out_however_the_stream_was_cut():
    data = b"".join(encode(message) for message in MESSAGES)
    for size in (1, 2, 7, 100, len(data)):
        buffer = LineBuffer()
        lines = []
        for start in range(0, len(data), size):
            lines += buffer.feed(data[start : start + size])
        assert [decode(one) for one in lines] == MESSAGES
        assert buffer.overlong == 0


def test_a_line_without_end_is_counted_once_and_skipped():
    buffer = LineBuffer()
    for _ in range(1000):
        assert buffer.feed(b"x" * 100) == []
        assert buffer.size <= MAX_LINE
    assert buffer.overlong == 1
    assert buffer.feed(b"x\nnext\nand") == [b"next"]
    assert buffer.feed(b" so on\n") == [b"and so on"]
    assert buffer.overlong == 1


def test_a_long_line_that_comes_at_once_is_counted_and_skipped():
    buffer = LineBuffer()
    most = MAX_LINE + TAG_LENGTH
    assert buffer.feed(b"a\n" + b"x" * (most + 1) + b"\nb\n") == [b"a", b"b"]
    assert buffer.feed(b"x" * most + b"\n") == [b"x" * most]
    assert buffer.overlong == 1
