"""What the documentation shows works: commands run, links lead on, all is named.

Commands stand in ```sh blocks, in tables in the column `command`, and inline where they begin as
one types them; programs in ```python blocks.  What a README must tell are names and numbers of the
program, never a sentence.
"""

import re
import shutil

import pytest
from lab_runs import left
from places import ROOT, SCRIPTS
from readme_commands import SKIPPED, TYPED, Shell, is_quick, is_skipped, replaced
from readme_text import blocks, is_broken, links, named, options, rows, section, stories, words

from laptop.course.handouts import HANDOUTS
from laptop.emulator.device.sensor_kinds import KINDS
from laptop.see.serve import announcements
from robot import turtle_graphics
from shared import state

MAIN = ROOT / "README.md"
DOCS = ROOT / "laptop" / "docs"
FILES = [MAIN, ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
FILES += [*sorted((ROOT / "tests").rglob("README.md")), *sorted(DOCS.rglob("*.md"))]
TEXTS = {file: file.read_text("utf-8") for file in FILES}
NAMES = [str(file.relative_to(ROOT)) for file in TEXTS]
SHOWN = [story for text in TEXTS.values() for story in stories(text)]
MAX_WORDS = 17500
"""Greatest number of words of the first page and the documentation: what is long nobody reads."""


def all_stories():
    """Return each story of all READMEs once, without what is skipped."""
    found = {}
    for story in SHOWN:
        parts = [part for line in story for part in replaced(line, TYPED).split(" && ")]
        found[tuple(part for part in parts if not is_skipped(part))] = None
    return [story for story in found if story]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder in which commands run, with what a reader has by then."""
    shutil.copy(SCRIPTS / "lab1_moves.py", tmp_path / "my_lab_script.py")
    for name, own in (("geared", "my.ini"), ("planar", "built.ini")):
        shutil.copy(ROOT / "shared" / "arms" / f"{name}.ini", tmp_path / own)
    left(tmp_path / "runs" / "line")
    (line,) = (handout for handout in HANDOUTS if handout.name == "line")
    for name in ("7b", "handouts"):
        (tmp_path / name).mkdir()
        (tmp_path / name / line.script).write_text(line.skeleton, "utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BRICKSERVO_STATE", str(tmp_path / "state"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("BROWSER", "true")  # it opens nothing


@pytest.mark.usefixtures("folder")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore:unclosed:ResourceWarning")
@pytest.mark.parametrize(
    "story",
    [
        pytest.param(story, marks=() if is_quick(story) else pytest.mark.long)
        for story in all_stories()
    ],
    ids=" && ".join,
)
def test_a_command_works(story):
    shell = Shell()
    try:
        for part in story:
            shell.run(part)
    finally:
        shell.close()


def test_the_programs_on_the_pages_are_the_examples():
    """tests/laptop/test_examples.py runs those."""
    shown = {snippet for text in TEXTS.values() for snippet in blocks(text, "python")}
    files = (ROOT / "laptop" / "examples").glob("[!_]*.py")
    assert shown == {file.read_text("utf-8") for file in files}


def test_few_commands_are_skipped_and_all_of_these_are_shown():
    assert len(SKIPPED) <= 8
    for start in SKIPPED:
        assert any(re.search(start, replaced(" && ".join(s), TYPED)) for s in SHOWN), start


def test_commands_are_found_where_they_stand():
    text = "`robot/driver.py --stay` `--stay`\n```sh\ntrack # so\n\ncp a b\n```\n"
    text += "```sh\ncp a b\nls\n```\n| what | command |\n|---|---|\n| it | `where` |\n"
    assert list(stories(text)) == [
        ("track # so",), ("cp a b",), ("cp a b", "ls"), ("where",), ("robot/driver.py --stay",)
    ]  # fmt: skip


def test_the_first_commands_are_the_same_in_powershell_and_in_ci():
    text = TEXTS[MAIN]
    (others,) = blocks(text, "powershell")
    ours = blocks(text, "sh")[0]
    in_ci = re.findall(r"^\.uv/bin/uv run .*pytest$", text, re.MULTILINE)[0]
    assert in_ci in ours
    ours = ours.replace("python3 -m pip", "py -m pip").replace(" --target .uv", "")
    assert others == ours.replace(" && ", "; ").replace(".uv/bin/uv run", "py -m uv run")


# Links


@pytest.mark.parametrize("file", TEXTS, ids=NAMES)
def test_every_link_leads_somewhere(file):
    assert [target for target in links(TEXTS[file]) if is_broken(target, file)] == []


@pytest.mark.parametrize(
    "target",
    ["robots/README.md", "#no-such-heading", "robot/README.md#no-such", "../../etc", "http://a b"],
)
def test_a_broken_link_is_seen(target):
    assert is_broken(target, MAIN)


def test_the_first_readme_is_short_and_pictures_are_shown():
    goals = {
        (file.parent / t.partition("#")[0]).resolve()
        for file, text in TEXTS.items()
        for t in links(text)
    }
    assert len(TEXTS[MAIN].splitlines()) <= 150
    assert set((DOCS / "pictures").iterdir()) <= goals
    assert {file for file in FILES if DOCS not in file.parents} - {MAIN} <= goals


def test_a_word_is_written_by_people():
    made = "<!-- [[[cog rooms() ]]] -->\n## laptop/\n```sh\nls\n```\n<!-- [[[end]]] -->\n"
    assert words(f"# Two words\n```sh\nls\n```\n{made}| `a b` | - |\n") == [
        "Two",
        "words",
        "`a",
        "b`",
    ]


def test_all_of_it_has_few_words():
    counts = {
        name: len(words(text))
        for name, (file, text) in zip(NAMES, TEXTS.items())
        if file == MAIN or DOCS in file.parents
    }
    longest = sorted(counts, key=counts.get)[-5:]
    assert sum(counts.values()) <= MAX_WORDS, f"shorten one, say of {longest}"


def test_options_of_the_readmes_and_of_the_programs_are_the_same():
    sources = [*(ROOT / "laptop" / "cli").glob("*.py"), *(ROOT / "robot").glob("*.py")]
    sources = [f.read_text("utf-8") for f in (*sources, ROOT / "tests" / "claims" / "__main__.py")]
    told = set().union(*map(options, TEXTS.values()))
    others = "--upgrade --target --group --no-project --help --constraints --reinstall --format"
    assert told <= set().union(*map(options, sources), others.split())  # of pip, uv and all
    for text in sources:
        for option in re.findall(r"""^\s*(?:[\w.]+\()?"(--[a-z/-]+)",""", text, re.MULTILINE):
            assert told & set(option.split("/")), option  # one, or one/its opposite


def words_of(module):
    """Return what the constants of a module hold that are words."""
    return [v for name, v in vars(module).items() if name.isupper() and isinstance(v, str)]


ARMS = "\n".join(file.read_text("utf-8") for file in (ROOT / "shared" / "arms").glob("*.ini"))
QUANTITIES = {name for kind in KINDS.values() for name in (kind.driver, *kind.quantities)}
TOLD = [
    ("reference/emulator", "Sensors", {*KINDS, *QUANTITIES}),
    ("reference/files", "From another program", words_of(announcements)),
    ("reference/files", "Variables and files", words_of(state)),
    ("reference/arm-file", "Keys", re.findall(r"^(\w+) *=", ARMS, re.MULTILINE)),
    ("how-to/write-a-program", "A turtle", turtle_graphics.COMMANDS),
]
"""Names of the programs that a section of a page must tell."""


@pytest.mark.parametrize(("page", "heading", "names"), TOLD)
def test_all_names_are_told(page, heading, names):
    assert names
    assert set(names) - named(section(TEXTS[DOCS / f"{page}.md"], heading)) == set()


def test_the_glossary_is_in_order_and_says_where_each_word_is_found():
    table = [tuple(row.values()) for row in rows(TEXTS[DOCS / "reference" / "glossary.md"])]
    words = [word for word, _, _ in table]
    assert len(words) >= 50
    assert words == sorted(set(words), key=str.lower)
    for *_, found in table:  # test_every_link_leads_somewhere follows it
        assert re.fullmatch(r"\[(\w+\.py)\]\(\S+/\1\)", found)
