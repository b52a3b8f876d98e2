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


@pytest.fixture(scope="module")
def reading(tmp_path_factory):
    """Folder, and by name: drawn or refused, what was said, what was touched."""
    if not sys.platform.startswith("linux"):
        pytest.skip("pipes, devices and a bound on memory, as Linux has them")
    folder = tmp_path_factory.mktemp("hostile")
    paths = {name: str(path) for name, path in make_all(folder).items()}
    env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests/helpers")])}
    done = python("-c", READER, MEMORY, input=json.dumps(paths), env=env)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder, json.loads(done.stdout)


CASES = {
    **{name: (what, pattern) for name, (_, what, pattern) in FILES.items()},
    **{name: ("refused", pattern) for name, (_, pattern) in SPECIAL.items()},
}


def test_there_are_many_of_them():
    assert len(CASES) >= 30


@pytest.mark.short(every=3)
@pytest.mark.parametrize("name", CASES)
def test_a_hostile_file_is_answered_in_one_sentence(name, reading):
    folder, said = reading
    wanted, pattern = CASES[name]
    what, sentence, _ = said[name]
    assert what == wanted, sentence
    assert re.search(pattern, sentence), sentence
    assert "\n" not in sentence
    assert len(sentence) < 400
    if what != DRAWN:
        assert sentence.startswith((f"{name}: ", f"{folder / name}: "))


def test_nothing_but_the_file_itself_is_opened(reading):
    folder, said = reading
    for name, (_, _, touched) in said.items():
        # Decoders write to nowhere what they would print.
        own = ["open", str(folder / name)], ["open", os.devnull]
        assert [what for what in touched if what not in own] == [], name
