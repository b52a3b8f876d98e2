"""INI files are read as configparser reads them; and what it refuses is refused."""

import configparser

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shared.ini import BadIni, read_ini, with_values

PIECES = [
    "[a]",
    "[b b] c",
    "x = 1",
    "Y:2",
    "  more",
    "",
    "  ",
    "# no",
    "  ; no",
    "z=a ; b",
    "w = #1",
]
PIECES += [
    "u = a;b # c",
    "v",
    "= 1",
    ": x = 2",
    "[]",
    "t =",
    "[c",
    "k k = [d]",
    "\tq = 3",
    "s = a = b",
]


def as_configparser(lines):
    """What configparser makes of it, as `read_ini` does; the line that it refuses first."""
    parser = configparser.ConfigParser(
        interpolation=None, inline_comment_prefixes=(";", "#"), default_section=""
    )
    try:
        parser.read_string("\n".join(lines))
    except (configparser.DuplicateSectionError, configparser.DuplicateOptionError) as error:
        return error.lineno
    except configparser.MissingSectionHeaderError as error:
        return error.lineno
    except configparser.ParsingError as error:
        return error.errors[0][0]
    return {name: dict(parser[name]) for name in parser.sections()}


def as_ours(lines):
    """What `read_ini` makes of it; the line that it refuses."""
    try:
        return {name: dict(values) for name, values in read_ini(lines).items()}
    except BadIni as error:
        return int("".join(filter(str.isdigit, error.problem)))


@given(st.lists(st.sampled_from(PIECES), max_size=12))
def test_it_reads_and_refuses_what_configparser_does(lines):
    expected = as_configparser(["[top]", *lines])
    ours = as_ours(["[top]", *lines])
    if isinstance(expected, int) and isinstance(ours, int):
        # (That one tells a line of no form last of all.)
        assert ours <= expected
        assert as_configparser(["[top]", *lines][:ours]) == ours
    else:
        assert ours == expected


def test_sections_and_keys_keep_their_order():
    found = read_ini("[z]\nq = 1\nb = 2\n[a]\nc = 3".splitlines())
    assert [(name, list(values)) for name, values in found.items()] == [
        ("z", ["q", "b"]),
        ("a", ["c"]),
    ]


@pytest.mark.parametrize(
    ("text", "section", "key", "problem"),
    [
        ("x = 1", None, None, "line 1 is outside any [section]"),
        ("[a]\n\nhello", None, None, "line 3 is not of the form key = value"),
        ("[a]\nx = 1\nX = 2", "a", "x", "is there twice (line 3)"),
        ("[a]\n[b]\n[a]", "a", None, "is there twice (line 3)"),
    ],
)
def test_what_is_wrong_is_said(text, section, key, problem):
    with pytest.raises(BadIni) as caught:
        read_ini(text.splitlines())
    error = caught.value
    assert (error.section, error.key, error.problem) == (section, key, problem)


@pytest.mark.parametrize(
    ("before", "values", "after"),
    [
        ("[a]\nx = 1   ; one\n", {("a", "x"): "-1"}, "[a]\nx = -1  ; one\n"),
        ("[a]\nx=1 # one\n[b]\nx: 2", {("b", "x"): "33"}, "[a]\nx=1 # one\n[b]\nx: 33"),
        ("[a]\r\nX = 12 ; y\r\n", {("a", "x"): "3"}, "[a]\r\nX = 3  ; y\r\n"),
        ("\ufeff[a]\nx =\n", {("a", "x"): "3"}, "\ufeff[a]\nx = 3\n"),
        ("[a]\nx = 1\ny = 2\n", {("a", "y"): "1", ("a", "x"): "2"}, "[a]\nx = 2\ny = 1\n"),
    ],
)
def test_a_value_is_changed_and_nothing_else(before, values, after):
    assert with_values(before, values) == after


@pytest.mark.parametrize("text", ["[a]\ny = 1\n", "[b]\nx = 1\n", "[a]\nx = 1\n  2\n", ""])
def test_a_value_that_is_not_there_or_goes_on_below_is_not_changed(text):
    with pytest.raises(BadIni, match="write it there"):
        with_values(text, {("a", "x"): "2"})
