"""Small files, whatever has become of them: read at once, or refused in words."""

import json
import os
import random
import resource
import stat

import pytest
from odd_files import ODD, put

from robot.motion.zero import NotHomed, Zero
from robot.tracker_address import InvalidMemory, Memory, SaltedKey, ServerAddress
from shared.arm_description import ArmError, BadArmFile, find_arm, read_arm
from shared.config_files import (
    MAX_SIZE,
    InvalidFile,
    check_replaceable,
    number,
    open_to_write,
    parse_json,
    read_json,
    read_text,
    write_whole,
)


@pytest.mark.parametrize("kind", sorted(ODD))
def test_what_is_no_such_file_is_refused_at_once(tmp_path, kind):
    make, message = ODD[kind]
    path = str(tmp_path / "file")
    make(path)
    with pytest.raises(InvalidFile) as error:
        read_json(path)
    assert message in str(error.value)


def test_what_is_not_there_is_not_spoilt(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_text(str(tmp_path / "none"))


def test_a_link_to_a_file_is_one_and_lines_end_as_they_should(tmp_path):
    put(str(tmp_path / "file"), "\u00e4\r\nb\rc\n".encode())
    os.symlink(str(tmp_path / "file"), str(tmp_path / "link"))
    assert read_text(str(tmp_path / "link")) == "\u00e4\nb\nc\n"
    put(str(tmp_path / "file"), b"x" * MAX_SIZE)
    assert len(read_text(str(tmp_path / "file"))) == MAX_SIZE


def test_no_descriptor_is_left_open(tmp_path):
    before = os.listdir("/proc/self/fd")
    for kind, (make, _) in ODD.items():
        make(str(tmp_path / kind))
        with pytest.raises(InvalidFile):
            read_json(str(tmp_path / kind))
    assert len(os.listdir("/proc/self/fd")) == len(before)


@pytest.mark.parametrize(
    "value",
    [True, False, None, "1", [], {}, 10**400, -(10**400), float("nan"), float("inf")],
    ids=str,
)
def test_what_is_no_number(value):
    with pytest.raises(InvalidFile):
        number(value)


@pytest.mark.parametrize("value", [0, -3, 2.5, 10**20])
def test_what_is_one(value):
    assert number(value) == value


def test_of_an_integer_of_thousands_of_digits_nothing_is_made():
    with pytest.raises(InvalidFile):
        number(parse_json('{"a": 1' + "0" * 400 + "}")["a"])
    with pytest.raises(InvalidFile):
        number(parse_json('{"a": 1' + "0" * 9000 + "}")["a"])


def test_a_pipe_that_nobody_reads_is_not_waited_for(tmp_path):
    os.mkfifo(str(tmp_path / "pipe"))
    with pytest.raises(OSError, match="No such device"):
        open_to_write(str(tmp_path / "pipe"))
    descriptor = open_to_write(str(tmp_path / "file"))
    os.write(descriptor, b"a")
    os.close(descriptor)
    descriptor = open_to_write(str(tmp_path / "file"), os.O_APPEND)
    os.write(descriptor, b"b")
    os.close(descriptor)
    assert read_text(str(tmp_path / "file")) == "ab"


def test_only_a_regular_file_is_replaced(tmp_path):
    check_replaceable(str(tmp_path / "nothing"))
    (tmp_path / "file").write_text("a")
    check_replaceable(str(tmp_path / "file"))
    os.mkfifo(str(tmp_path / "pipe"))
    with pytest.raises(InvalidFile, match="is a pipe, not a file"):
        check_replaceable(str(tmp_path / "pipe"))
    with pytest.raises(InvalidFile, match="is a folder, not a file"):
        check_replaceable(str(tmp_path))


# All who keep such files


ARM = read_arm(find_arm("planar"))
COUNTS = {"A": 0, "B": 0, "C": 0}


# Whole or not at all


class Crash(BaseException):
    """The end of the program, at any line of it."""


def crash(*args):
    raise Crash


@pytest.mark.parametrize("mode", [None, 0o600])
@pytest.mark.parametrize("at", ["fsync", "replace"])
def test_a_crash_before_the_draft_takes_its_place_leaves_the_old_file(
    tmp_path, monkeypatch, at, mode
):
    file = str(tmp_path / "file")
    write_whole(file, "old", mode)
    with monkeypatch.context() as patch:
        patch.setattr(os, at, crash)
        with pytest.raises(Crash):
            write_whole(file, "new", mode)
    assert read_text(file) == "old"
    assert os.listdir(str(tmp_path)) == ["file"]
    write_whole(file, "new", mode)
    assert read_text(file) == "new"
    assert os.listdir(str(tmp_path)) == ["file"]


@pytest.mark.parametrize("mode", [None, 0o600])
def test_a_disk_that_fills_up_leaves_the_old_file_and_no_draft(tmp_path, mode):
    file = str(tmp_path / "file")
    write_whole(file, "old", mode)
    most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2, most[1]))
    try:
        with pytest.raises(OSError, match="File too large"):
            write_whole(file, "new", mode)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, most)
    assert read_text(file) == "old"
    assert os.listdir(str(tmp_path)) == ["file"]


def test_it_is_on_the_card_before_it_takes_the_place_of_the_old_one(tmp_path, monkeypatch):
    done = []
    for name in ("fsync", "replace"):
        real = getattr(os, name)
        monkeypatch.setattr(
            os, name, lambda *args, name=name, real=real: (done.append(name), real(*args))[1]
        )
    write_whole(str(tmp_path / "a"), "text")
    write_whole(str(tmp_path / "b"), "text", sync=False)
    assert done == ["fsync", "replace", "replace"]


def test_the_folder_is_made_and_only_the_user_may_read(tmp_path):
    file = tmp_path / "state" / "of" / "mine"
    (tmp_path / "state").mkdir()
    write_whole(str(file), "\u00e4\r\n", 0o600)
    assert file.read_bytes() == "\u00e4\r\n".encode()
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    draft = tmp_path / "state" / "of" / "mine.new"
    draft.write_text("of others")
    draft.chmod(0o644)
    with draft.open() as of_others:
        write_whole(str(file), "secret", 0o600)
        assert of_others.read() == "of others"
    assert file.read_text() == "secret"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def zero_in(folder):
    Zero(ARM, folder).save(dict.fromkeys(COUNTS, 1.5), COUNTS)
    zero = Zero(ARM, folder)
    return zero.file, lambda: zero.confirmed(COUNTS), NotHomed


def memory_in(folder):
    memory = Memory(folder)
    memory.save(ServerAddress("here", 7711, "ABCDEFGHJKMN"), SaltedKey("5a" * 16, b"k" * 32))
    return memory.file, memory.load, InvalidMemory


def arm_in(folder):
    path = os.path.join(folder, "my.ini")
    with open(ARM.file, "rb") as file:
        put(path, file.read())
    return path, lambda: read_arm(path), BadArmFile


SAVERS = [zero_in, memory_in, arm_in]


@pytest.mark.parametrize("save", SAVERS, ids=lambda save: save.__name__[:-3])
@pytest.mark.parametrize("kind", sorted(ODD))
def test_whoever_keeps_one_says_in_a_sentence_what_is_wrong(tmp_path, save, kind):
    file, read, error_class = save(str(tmp_path))
    read()
    os.remove(file)
    ODD[kind][0](file)
    with pytest.raises(error_class) as error:
        read()
    text = str(error.value)
    assert os.path.basename(file) in text
    assert "\n" not in text
    assert len(text) < 400


PIECES = [
    b"", b"{", b"}", b"[", b'"', b":", b",", b"0", b"-", b"e", b"true", b"null", b"NaN", b"\xff",
    b"\x00", b"\n", b"1e999", b"1" + b"0" * 400, b"9" * 5000, b"[" * 3000, b'{"a":' * 3000,
    b"\\u0000", b"\\ud800", b"version", b"0.5", b" ",
]  # fmt: skip


def mutated(data, dice):
    """Some bytes of it replaced, removed, doubled or exchanged."""
    for _ in range(dice.randint(1, 4)):
        a, b = sorted(dice.randint(0, len(data)) for _ in range(2))
        b = min(b, a + dice.choice((1, 2, 8, 40)))
        middle = dice.choice((dice.choice(PIECES), data[a:b] * 2, b"", data[a:b][::-1]))
        data = data[:a] + middle + data[b:]
    return data


@pytest.mark.parametrize("save", SAVERS, ids=lambda save: save.__name__[:-3])
def test_no_mutation_gets_past_them(tmp_path, save):
    """A thousand of each; 10^6 were tried once."""
    file, read, error_class = save(str(tmp_path))
    with open(file, "rb") as there:
        content = there.read()
    refused = read_after_all = 0
    for seed in range(1000):
        put(file, mutated(content, random.Random(seed)))
        try:
            read()
        except error_class as error:
            refused += isinstance(error, ArmError) and "\n" not in str(error)
        else:
            read_after_all += 1
    assert refused + read_after_all == 1000
    assert refused > 400


def test_the_good_ones_are_read(tmp_path):
    for save in SAVERS:
        (tmp_path / save.__name__).mkdir()
        save(str(tmp_path / save.__name__))[1]()
    assert json.loads(read_text(zero_in(str(tmp_path))[0]))["version"] == 2
