"""The scripts' command lines: read as argparse reads them, and told at any width, on any Python."""

import importlib
import random
import re
from pathlib import Path

import pytest

from robot import command_line, program
from robot.command_line import BadArgument, Parser, number_in
from shared.arm_description import ArmError

ROBOT = Path(command_line.__file__).parent
SCRIPTS = sorted(
    path.stem for path in ROBOT.glob("*.py") if "exit(main())" in path.read_text(encoding="utf-8")
)

PIECES = re.compile(r"\(.*?\)+|\[.*?\]+|\S+")
"""What Python 3.5 may break a line of usage between."""

WORDS = ("", "10,0", "5,10", " -5,10", "1,1,1", "x", "3", "0.5", "none", "1e9", "-3", "-", "--")
WORDS += ("up", "smooth", "planar", "marker", "B:1,2", "--speed=4", "--stay=1", "--nix", "--help")
WORDS += ("--s", "--met", "look", "ABCD-EFGH", "192.168.0.5:77")


@pytest.fixture(params=SCRIPTS)
def parser(request, monkeypatch):
    """The Parser of a script."""

    class Caught(Exception):
        pass

    def catch(parser, argv=None):
        raise Caught(parser)

    with monkeypatch.context() as patch:
        for name in ("parse_args", "parse_known_args"):
            patch.setattr(Parser, name, catch)
        with pytest.raises(Caught) as caught:
            importlib.import_module("robot." + request.param).main([])
    return caught.value.args[0]


def of_argparse(parser):
    """All that argparse makes of it, by the beginning of their lines of usage."""
    commands = [command.name for command, _ in parser._commands]
    main = parser.with_argparse()
    choices = next((a.choices for a in main._actions if a.dest == "command"), {})
    assert sorted(choices) == sorted(commands)
    return [main] + [choices[name] for name in commands]


def test_every_script_is_tested():
    assert {"driver", "tracking_client", "visual_servoing", "bench_brick"} <= set(SCRIPTS)


@pytest.mark.parametrize("name", ["driver", "visual_servoing", "tracking_client", "bench_brick"])
def test_its_help_ends_with_two_examples(name, capsys):
    with pytest.raises(SystemExit):
        importlib.import_module("robot." + name).main(["--help"])
    title, one, other = capsys.readouterr().out.splitlines()[-3:]
    assert title == "examples:"
    for example in (one, other):
        assert re.match(rf"  {name}\.py \S", example)


def test_its_usage_can_be_wrapped(parser, monkeypatch):
    """Python 3.5 takes it apart, and gives up where brackets stand within a word of an option."""
    for one in of_argparse(parser):
        monkeypatch.setenv("COLUMNS", "1000")
        usage = one.format_usage().split(None, 1)[1].strip()
        assert " ".join(PIECES.findall(usage)) == usage
        for columns in ("20", "40", "80"):
            monkeypatch.setenv("COLUMNS", columns)
            assert "--help" in one.format_help()


def outcome(read, argv, capsys):
    """What comes of reading a command line: the values by name, or the status and what is said."""
    try:
        values = vars(read(argv, command_line.Values()))
    except SystemExit as end:
        return end.code, capsys.readouterr()
    return values


def made_up(parser, rng):
    """A command line, right as often as not."""
    argv = []
    commands = [command for command, _ in parser._commands]
    arguments = list(parser._arguments)
    for _ in range(rng.randrange(4)):
        if commands and rng.random() < 0.5:
            command = rng.choice(commands)
            argv.append(command.name)
            arguments, commands = arguments + command._arguments, []
        one = rng.choice(arguments or [None])
        if one and one.is_option:
            argv.append(rng.choice(one.flags))
        if one is None or one.takes_value or rng.random() < 0.1:
            argv.append(rng.choice(WORDS + tuple(one.options.get("choices", ())) if one else WORDS))
        if one and not one.is_option and rng.random() < 0.5:
            argv.append(rng.choice(WORDS))
    return argv


def test_it_reads_what_argparse_reads(parser, capsys):
    rng = random.Random(1)
    argparse = parser.with_argparse()
    here, refused = 0, 0
    for _ in range(400):
        argv = made_up(parser, rng)
        expected = outcome(argparse.parse_args, argv, capsys)
        values = outcome(lambda argv, _: parser.parse_args(argv), argv, capsys)
        assert values == expected, argv
        here += parser._usual(argv) is not None if isinstance(values, dict) else 0
        refused += not isinstance(values, dict)
    assert here > 30
    assert refused > 30


def small():
    """One with a bit of everything."""
    parser = Parser("small.py", "For tests.")
    parser.add_argument("-n", "--number", type=number_in(1, 5, "cm"), default="3")
    parser.add_argument("--also", action="append", default=[])
    parser.add_argument("--yes-no", action="store_true")
    parser.add_argument("--which", choices=("a", "b"))
    go = parser.add_command("go", "on")
    go.add_argument("places", nargs="*", metavar="PLACE")
    go.add_argument("--fast", required=True)
    parser.add_command("stop", "it").add_argument("where", nargs="?", metavar="WHERE")
    return parser


@pytest.mark.parametrize(
    ("line", "values"),
    [
        ("", {"command": None, "number": 3.0, "also": [], "yes_no": False}),
        ("-n 2 --yes-no", {"command": None, "number": 2.0, "also": [], "yes_no": True}),
        ("--also a stop --also=b", {"command": "stop", "also": ["a", "b"], "where": None}),
        ("stop here", {"command": "stop", "where": "here", "number": 3.0}),
        ("go --fast 1 a b", {"command": "go", "fast": "1", "places": ["a", "b"]}),
        ("go --fast 1", {"command": "go", "fast": "1", "places": []}),
    ],
)
def test_the_usual_is_read_without_argparse(line, values, monkeypatch):
    monkeypatch.setattr(Parser, "with_argparse", None)
    read = vars(small().parse_args(line.split()))
    assert {name: read[name] for name in values} == values
    assert vars(small().parse_known_args(line.split())[0]) == read


@pytest.mark.parametrize(
    "line",
    ["--help", "nowhere", "-n", "-n -1", "--yes-no=1", "--numb 2", "--which c", "--", "stop -"]
    + ["stop a b", "go", "go a --fast 1 b", "go --fast", "go --fast 1 -- a", "stop -n 2 --fast 1"],
)
def test_the_unusual_is_left_to_argparse(line):
    assert small()._usual(line.split()) is None


def test_a_wrong_value_is_told_without_argparse(monkeypatch, capsys):
    monkeypatch.setattr(Parser, "with_argparse", None)
    for line, name in (("-n 7", "small.py"), ("stop -n 7", "small.py stop")):
        with pytest.raises(SystemExit) as end:
            small().parse_args(line.split())
        assert end.value.code == 2
        assert capsys.readouterr().err == (
            f"{name}: argument -n/--number: '7' must be a number from 1 to 5 cm;"
            f" see {name} --help\n"
        )


@pytest.mark.parametrize(
    ("flags", "options"),
    [
        (["--many"], {"nargs": "+"}),
        (["--count"], {"action": "count"}),
        (["second"], {"metavar": "SECOND"}),
    ],
)
def test_an_argument_that_it_could_not_read_is_refused_at_once(flags, options):
    parser = Parser("small.py")
    parser.add_argument("first", metavar="FIRST")
    with pytest.raises(ValueError, match=flags[0]):
        parser.add_argument(*flags, **options)


def test_nothing_that_is_told_of_a_failure_steers_the_terminal(capsys, monkeypatch):
    def fail():
        raise ArmError("no \x1b[31mfile 'a\x9b\nb'")

    monkeypatch.setattr(program, "raise_on_signals", lambda: None)
    assert program.run("a.py", fail) == 1
    assert capsys.readouterr().err == "a.py: no  [31mfile 'a  b'\n"
    with pytest.raises(SystemExit):
        Parser("a.py", "", "").error("'\x1b[2J' is none")
    assert capsys.readouterr().err == "a.py: ' [2J' is none; see a.py --help\n"


def test_numbers_have_limits():
    read = number_in(-1, 2.5, "cm")
    assert [read(text) for text in ("-1", " 2.5", "0")] == [-1, 2.5, 0]
    for text in ("2.6", "nan", "-inf", "", "two"):
        with pytest.raises(BadArgument, match="must be a number from -1 to 2.5 cm"):
            read(text)
