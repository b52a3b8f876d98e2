"""Reader of INI files like `configparser`, whose import costs the brick 13 M instructions.

    [section]          # a comment, also with ;
    key = value        ; keys are in small letters, whatever the file has

Pure: lines in, values out.
"""

from collections import OrderedDict

MYPY = False
if MYPY:
    from typing import Dict, Mapping, Optional, Sequence, Tuple  # noqa: F401


class BadIni(ValueError):
    """Error for an INI text that is malformed.

    Args:
        section, key: where the problem is; None: the line itself is malformed.
        problem: one line for people.

    Attributes:
        section, key: where the problem is; None: the line itself is malformed.
        problem: what is wrong, in words.
    """

    def __init__(self, section, key, problem):
        # type: (Optional[str], Optional[str], str) -> None
        super(BadIni, self).__init__(problem)
        self.section, self.key, self.problem = section, key, problem


def read_ini(lines):
    # type: (Sequence[str]) -> Dict[str, Dict[str, str]]
    """Read the values by section and key, in the order of the lines: OrderedDicts of texts.

    Args:
        lines: texts, without their line ends.

    Raises:
        BadIni: a section or key stands there twice, or a line is neither.
    """
    sections = OrderedDict()  # type: Dict[str, Dict[str, str]]
    section = key = None  # type: Optional[str]
    values = OrderedDict()  # type: Dict[str, str]
    depth = 0
    for number, line in enumerate(lines, 1):
        text = _without_comment(line)
        if not text:
            if key and line.strip() == "":
                values[key] += "\n"
            continue
        indent = len(line) - len(line.lstrip())
        if key and indent > depth:
            values[key] += "\n" + text
            continue
        depth = indent
        if text[0] == "[" and text.find("]") > 1:
            section, key = text[1 : text.index("]")], None
            if section in sections:
                raise BadIni(section, None, "is there twice (line {})".format(number))
            values = sections[section] = OrderedDict()
            continue
        if section is None:
            raise BadIni(None, None, "line {} is outside any [section]".format(number))
        end = min(text.find(sign) if sign in text else len(text) for sign in "=:")
        if not 0 < end < len(text):
            raise BadIni(None, None, "line {} is not of the form key = value".format(number))
        key = text[:end].rstrip().lower()
        if key in values:
            raise BadIni(section, key, "is there twice (line {})".format(number))
        values[key] = text[end + 1 :].strip()
    for values in sections.values():
        for key in values:
            values[key] = values[key].rstrip()
    return sections


def with_values(text, values):
    # type: (str, Mapping[Tuple[str, str], str]) -> str
    """Return the text of a file with new values; comments, order and line ends stay.

    A comment behind a value stays in its column where it can.

    Args:
        text: of the file.
        values: {(section, key): text}; all keys stand in the file.

    Raises:
        BadIni: a key is missing, or its value goes over several lines.
    """
    mark = text[: text.startswith("\ufeff")]
    lines, section, left = text[len(mark) :].splitlines(True), "", dict(values)
    for number, line in enumerate(lines):
        plain = _without_comment(line)
        if plain.startswith("[") and plain.find("]") > 1 and not line[0].isspace():
            section = plain[1 : plain.index("]")]
            continue
        end = min(plain.find(sign) if sign in plain else len(plain) for sign in "=:")
        place = section, plain[:end].rstrip().lower()
        if place not in left or line[0].isspace():
            continue
        begin = line.index(plain[end]) + 1
        begin += len(line[begin:]) - len(line[begin:].lstrip(" \t"))
        old, rest = plain[end + 1 :].strip(), line[begin:]
        rest, new = rest[len(old) :], left.pop(place)
        if not old and not line[begin - 1].isspace():
            new = " " + new
        blanks = len(rest) - len(rest.lstrip(" "))
        if rest.strip():  # a comment
            rest = " " * max(1, blanks + len(old) - len(new)) + rest[blanks:]
        lines[number] = line[:begin] + new + rest
    changed = "".join(lines)
    read = read_ini(changed.splitlines())
    for (section, key), value in values.items():
        if read.get(section, {}).get(key) != value:
            raise BadIni(section, key, "is not on a line of its own; write it there")
    return mark + changed


def _without_comment(line):
    # type: (str) -> str
    """Return a line, stripped, without the comment that begins at its start or after a blank."""
    if ";" in line or "#" in line:
        for at, letter in enumerate(line):
            if letter in ";#" and (at == 0 or line[at - 1].isspace()):
                line = line[:at]
                break
    return line.strip()
