"""Hostile files: one sentence each, nothing else opened or fetched, and memory bounded.

All are read by one process of its own, which may not grow, and tells what it opens.
"""

import json
import os
import re
import sys

import pytest
from hostile_files import DRAWN, FILES, SPECIAL, make_all
from own_python import python
from places import ROOT

MEMORY = 800_000_000
"""So many bytes more than at its start the process may have."""

READER = """
import json, os, resource, sys
from laptop.drawing.artwork import BadArtwork
from laptop.drawing.pictures import read_picture
from laptop.drawing.lettering import write_text
from laptop.drawing.sources import read_source
from hostile_files import picture
# All that is loaded late is there before anything is watched
write_text("warm"), read_picture(picture(".jpg")), read_picture(picture(".png"))
for encoding in ("utf-8-sig", "utf-16-le", "utf-16-be"):
    "x".encode(encoding).decode(encoding)

memory, paths = int(sys.argv[1]), json.load(sys.stdin)
pages = int(open("/proc/self/statm").read().split()[0])
limit = pages * resource.getpagesize() + memory
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
touched = []
def watch(event, arguments):
    if event == "open" and isinstance(arguments[0], int):
        return  # a descriptor, of what was opened before
    if event == "open" or event.startswith(("socket.", "urllib.", "subprocess.", "os.exec")):
        touched.append([event, str(arguments[0])])
sys.addaudithook(watch)
said = {}
for name, path in paths.items():
    user = os.geteuid()
    if name == "locked.svg" and user == 0:
        os.seteuid(65534)  # nothing is locked to root
    touched.clear()
    try:
        artwork = read_source(path)
        count = len(artwork.strokes)
        what = f"{count} stroke{'s' if count != 1 else ''}; {' '.join(artwork.left_out)}".strip()
        said[name] = ["drawn", what, list(touched)]
    except BadArtwork as error:
        said[name] = ["refused", str(error), list(touched)]
    finally:
        os.seteuid(user)
json.dump(said, sys.stdout)
"""


def read_all(folder, is_asked_for):
    """Folder, and by name: drawn or refused, what was said, what was touched."""
    if not sys.platform.startswith("linux"):
        pytest.skip("pipes, devices and a bound on memory, as Linux has them")
    paths = {name: str(path) for name, path in make_all(folder).items() if is_asked_for(name)}
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests/helpers")])}
    done = python("-c", READER, MEMORY, input=json.dumps(paths), env=env)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder, json.loads(done.stdout)


SLOW = ("many_rules", "million_moves", "use_laughs", "million_segments", "use_in_a_long_ring")
"""What a second or more is spent on before it is refused or drawn."""


def is_slow(name):
    """Whether a file is read in the long tests only."""
    return name.startswith(SLOW)


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """All files but the slow ones, read."""
    return read_all(tmp_path_factory.mktemp("hostile"), lambda name: not is_slow(name))


@pytest.fixture(scope="module")
def slow(tmp_path_factory):
    """The slow files, read."""
    return read_all(tmp_path_factory.mktemp("hostile"), is_slow)


CASES = {
    **{name: (what, pattern) for name, (_, what, pattern) in FILES.items()},
    **{name: ("refused", pattern) for name, (_, pattern) in SPECIAL.items()},
}


def test_there_are_many_of_them():
    assert len(CASES) >= 30


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.long] * is_slow(name)) for name in CASES],
)
def test_a_hostile_file_is_answered_in_one_sentence(name, request):
    folder, said = request.getfixturevalue("slow" if is_slow(name) else "quick")
    wanted, pattern = CASES[name]
    what, sentence, _ = said[name]
    assert what == wanted, sentence
    assert re.search(pattern, sentence), sentence
    assert "\n" not in sentence
    assert len(sentence) < 400
    if what != DRAWN:
        assert sentence.startswith((f"{name}: ", f"{folder / name}: "))


@pytest.mark.parametrize("which", ["quick", pytest.param("slow", marks=pytest.mark.long)])
def test_nothing_but_the_file_itself_is_opened(which, request):
    folder, said = request.getfixturevalue(which)
    assert said
    for name, (_, _, touched) in said.items():
        # Decoders write to nowhere what they would print.
        own = ["open", str(folder / name)], ["open", os.devnull]
        assert [what for what in touched if what not in own] == [], name
