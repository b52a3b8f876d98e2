"""Reading of the command lines of the brick's scripts.

What is usual is read here; only what is not (help, a mistake, an abbreviation) is left to argparse,
which makes of the same arguments what it would have made of all: to import it and set it up takes
the brick a second.
"""

import math
import sys

from shared.state import CODE

MYPY = False
if MYPY:
    import argparse
    from typing import Any, Callable, List, NoReturn, Optional, Sequence, Tuple  # noqa: F401

    Given = Tuple["_Argument", List[str], "Parser"]  # what is given, its texts, who reads it
    Values = argparse.Namespace

CODE_HELP = (
    "as the tracker prints it; others on that computer can read it in this command (default: ${}, "
    "else as remembered, else it is asked for)".format(CODE)
)
"""Help of the option `--code` of scripts that pair with the tracker."""


class BadArgument(ValueError):
    """A text is not what an argument takes; the message is for people."""


def number_in(lower, upper, unit):
    # type: (float, float, str) -> Callable[[str], float]
    """Return a `type` for an argument: it reads a number within these limits, both included.

    Args:
        lower: least number.
        upper: greatest number.
        unit: their unit, for people.
    """

    def read(text):
        # type: (str) -> float
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not lower <= value <= upper:
            raise BadArgument(
                "'{}' must be a number from {:g} to {:g} {}".format(
                    text.strip()[:40], lower, upper, unit
                )
            )
        return value

    return read


def _refuse(prog, message):
    # type: (str, str) -> NoReturn
    """End a program with one line: nothing has been done."""
    from shared.message_fields import printable  # what was typed may be anything

    sys.stderr.write("{0}: {1}; see {0} --help\n".format(prog, printable(message)))
    sys.exit(2)


if not MYPY:

    class Values(object):
        """Values of a command line, by the names of its arguments."""

        def __contains__(self, name):
            return name in vars(self)


class _Unusual(Exception):
    """A command line that argparse has to read."""


class _Argument(object):
    """One argument, as argparse.add_argument takes it; of what that knows, only what is used."""

    def __init__(self, *flags, **options):
        # type: (*str, **Any) -> None
        self.flags, self.options = flags, options
        self.is_option = flags[0].startswith("-")
        name = options.get("dest") or next((f for f in flags if f.startswith("--")), flags[0])
        self.dest = name.lstrip("-").replace("-", "_")
        self.action = options.get("action", "store")
        self.takes_value = self.action != "store_true"
        self.nargs = options.get("nargs")
        usual = ("store", "store_true", "append") if self.is_option else ("store",)
        if self.action not in usual or (self.is_option and self.nargs is not None):
            raise ValueError("{} is an argument of a kind that is not known".format(name))

    @property
    def shown(self):
        # type: () -> str
        """Name in a message."""
        return "/".join(self.flags) if self.is_option else self.options["metavar"]

    def default(self):
        # type: () -> Any
        """Return its value when it is not given."""
        value = self.options.get("default", None if self.takes_value else False)
        if value is None and self.nargs == "*":
            return []
        return self.read(value) if isinstance(value, str) else value

    def read(self, text):
        # type: (str) -> Any
        """Return the value of a text.

        Raises:
            BadArgument: it is none.
        """
        value = self.options.get("type", str)(text)
        if value not in self.options.get("choices", (value,)):
            raise _Unusual
        return value

    def takes(self, number):
        # type: (int) -> bool
        """Return whether it takes this number of texts."""
        if self.nargs is None:
            return number == 1
        least = {"?": 0, "*": 0, "+": 1}.get(self.nargs, self.nargs)  # type: int
        most = {"?": 1, "*": number, "+": number}.get(self.nargs, self.nargs)  # type: int
        return least <= number <= most

    def value(self, texts):
        # type: (Sequence[str]) -> Any
        """Return the value of these texts, which are right in number; of none, its default."""
        if not texts:
            return self.default()
        values = [self.read(text) for text in texts]
        return values[0] if self.nargs in (None, "?") else values


class Parser(object):
    """A command line that is refused in one line.

    Arguments are added as with argparse.ArgumentParser; commands by `add_command`.

    Args:
        prog: name of the script.
        description: text for the help.
        examples: command lines, one a line, for the end of the help.
        name: name of the command whose parser it is; "": the script's own.
    """

    def __init__(self, prog, description=None, examples=None, name=""):
        # type: (str, Optional[str], Optional[str], str) -> None
        self.prog = prog
        self.name = name
        self.description = description
        self.examples = examples
        self._arguments = []  # type: List[_Argument]
        self._commands = []  # type: List[Tuple[Parser, str]] # each and its line in the help

    def add_argument(self, *flags, **options):
        # type: (*str, **Any) -> None
        """Add an argument; of those without a dash at most one."""
        argument = _Argument(*flags, **options)
        if not argument.is_option and self._positional():
            raise ValueError("{} is one argument too many".format(flags[0]))
        self._arguments.append(argument)

    def add_command(self, name, text):
        # type: (str, str) -> Parser
        """Add a command; the options of this parser are accepted before and after its name.

        Args:
            name: as it is typed.
            text: its line in the help, and the first of its own.

        Returns:
            The Parser for what else may follow it.
        """
        command = Parser("{} {}".format(self.prog, name), name=name)
        self._commands.append((command, text))
        return command

    def error(self, message):
        # type: (str) -> NoReturn
        """End the program with one line: nothing has been done."""
        _refuse(self.prog, message)

    def parse_args(self, argv=None):
        # type: (Optional[Sequence[str]]) -> Values
        """Return the Values of a command line; of the script's own if it is None."""
        argv = sys.argv[1:] if argv is None else argv
        values = self._usual(argv)
        return values or self.with_argparse().parse_args(argv, Values())

    def parse_known_args(self, argv=None):
        # type: (Optional[Sequence[str]]) -> Tuple[Values, List[str]]
        """Return the same, and a list of unknown arguments."""
        argv = sys.argv[1:] if argv is None else argv
        values = self._usual(argv)
        return (values, []) if values else self.with_argparse().parse_known_args(argv, Values())

    # Usual command lines

    def _usual(self, argv):
        # type: (Sequence[str]) -> Optional[Values]
        try:
            return self._read(argv)
        except _Unusual:
            return None

    def _options(self):
        # type: () -> List[_Argument]
        return [argument for argument in self._arguments if argument.is_option]

    def _positional(self):
        # type: () -> Optional[_Argument]
        return next((one for one in self._arguments if not one.is_option), None)

    def _read(self, argv):
        # type: (Sequence[str]) -> Values
        """Return the Values of a usual command line.

        Raises:
            _Unusual: this is none.
        """
        given, parser = self._sorted(argv)
        required = [one for one in parser._arguments if one.options.get("required")]
        if any(one not in [argument for argument, _, _ in given] for one in required):
            raise _Unusual
        values = Values()
        for argument in self._arguments + (parser._arguments if parser is not self else []):
            setattr(values, argument.dest, argument.default())
        if self._commands:
            values.command = parser.name or None
        for argument, texts, reader in given:
            try:
                if not argument.takes_value:
                    value = True
                elif argument.action == "append":
                    value = getattr(values, argument.dest) + [argument.read(texts[0])]
                else:
                    value = argument.value(texts)
            except BadArgument as problem:
                reader.error("argument {}: {}".format(argument.shown, problem))
            except ValueError:  # argparse will meet the same, and reports it in its own way
                raise _Unusual from None
            setattr(values, argument.dest, value)
        return values

    def _sorted(self, argv):
        # type: (Sequence[str]) -> Tuple[List[Given], Parser]
        """Sort texts by arguments.

        Returns:
            List of (argument, its texts, the Parser that reads it), and the command's Parser.

        Raises:
            _Unusual: it is not that plain.
        """
        parser, ended = self, False
        given = []  # type: List[Given]
        loose = None  # type: Optional[List[str]]
        options = {flag: one for one in self._options() for flag in one.flags}
        args = iter(argv)
        for arg in args:
            if len(arg) > 1 and arg.startswith("-"):
                flag, is_joined, text = arg.partition("=")
                if flag not in options or (is_joined and not options[flag].takes_value):
                    raise _Unusual
                if options[flag].takes_value and not is_joined:
                    text = next(args, "-")
                    if text.startswith("-"):
                        raise _Unusual
                given.append((options[flag], [text], parser))
                ended = loose is not None
            elif parser is self and self._commands:
                commands = [one for one, _ in self._commands if one.name == arg]
                if not commands:
                    raise _Unusual
                parser = commands[0]
                options.update({flag: one for one in parser._options() for flag in one.flags})
            elif ended or arg == "-":
                raise _Unusual
            elif loose is None:
                loose, positional = [arg], parser._positional()
                if positional is None:
                    raise _Unusual
                given.append((positional, loose, parser))
            else:
                loose.append(arg)
        positional = parser._positional()
        if positional and not positional.takes(len(loose or ())):
            raise _Unusual
        return given, parser

    # Unusual ones

    def with_argparse(self):
        # type: () -> argparse.ArgumentParser
        """Return an argparse.ArgumentParser of the same arguments."""
        import argparse  # not above, see there

        from shared.version import VERSION

        class Refusing(argparse.ArgumentParser):
            def error(self, message):
                # type: (str) -> NoReturn
                _refuse(self.prog, message)

        def add(parser, arguments, **other):
            # type: (argparse.ArgumentParser, Sequence[_Argument], **Any) -> None
            for argument in arguments:
                options = dict(argument.options, **other)
                if "type" in options:
                    options["type"] = reporting(options["type"])
                parser.add_argument(*argument.flags, **options)

        def reporting(read):
            # type: (Callable[[str], Any]) -> Callable[[str], Any]
            def checked(text):
                # type: (str) -> Any
                try:
                    return read(text)
                except BadArgument as problem:
                    raise argparse.ArgumentTypeError(str(problem)) from None

            return checked

        parser = Refusing(
            prog=self.prog,
            description=self.description,
            epilog=self.examples and "examples:\n" + self.examples,
            formatter_class=argparse.RawDescriptionHelpFormatter,  # an example keeps its line
        )
        add(parser, self._arguments)
        parser.add_argument("--version", action="version", version="brickservo " + VERSION)
        if self._commands:
            commands = parser.add_subparsers(dest="command", metavar="COMMAND")
            for command, text in self._commands:
                one = commands.add_parser(command.name, help=text, description=text)
                add(one, self._options(), default=argparse.SUPPRESS)
                add(one, command._arguments)
        return parser
