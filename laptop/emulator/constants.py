"""Grammar of `KEY=VALUE,KEY=VALUE,...`, in which people set the emulator's constants.

A table declares the constants: the plant's is in `device.plant_constants`, the scene's in
`scene.scene_constants`.
"""

import math
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

MYPY = False
if MYPY:
    from typing import Collection, Mapping  # noqa: F401

    Value = Any  # as the kind of its Constant says; None: not given
    Owned = Dict[str, Dict[str, List[Value]]]
    Reader = Callable[[str, str, str], Any]


class Constant(
    NamedTuple(
        "Constant",
        [
            ("default", Any),
            ("allowed", Tuple[Any, ...]),
            ("unit", str),
            ("meaning", str),
            ("kind", type),
        ],
    )
):
    """One constant of a table.

    Args:
        default: its value if nothing is written; None: not given.
        allowed: (lower, upper) of a number, or the words that it may be.
        unit: "" if there is none.
        meaning: for people.
        kind: float, int for whole numbers, or str for words.
    """

    __slots__ = ()

    def __new__(
        cls, default: "Value", allowed: Tuple[Any, ...], unit: str, meaning: str, kind: type = float
    ) -> "Constant":
        """Take what is given; a constant is a number if nothing is said."""
        return super(Constant, cls).__new__(cls, default, allowed, unit, meaning, kind)


class Wording(NamedTuple("Wording", [("unknown", str), ("value", str), ("limit", str)])):
    """Wording of a table's messages.

    Args:
        unknown: message about an unknown key, with the fields {key}, {item} and {known}.
        value: placeholder for a value in advice.
        limit: format of the limits of a number.
    """

    __slots__ = ()

    def __new__(cls, unknown: str, value: str = "VALUE", limit: str = "{:g}") -> "Wording":
        """Take what is given."""
        return super(Wording, cls).__new__(cls, unknown, value, limit)


class Owners(NamedTuple("Owners", [("names", Sequence[str]), ("common", Sequence[str])])):
    """Single things that may have constants of their own.

    Args:
        names: of the things; KEY with such a name and a dot before it is that one's own.
        common: keys that all of them share.
    """

    __slots__ = ()


class ConstantTable(object):
    """Table of the constants of one thing, as people write and read them.

    Args:
        noun: the thing, with which every message begins.
        constants: key -> Constant, in the order of the listing.
        error: exception to raise, with one line for people.
        wording: of the messages.
        ranged: keys that may be written LOW..HIGH, to draw from.
        owners: things with constants of their own.
        reader: `reader(key, text, written)` gives the list of a key's values in place of the one
            that `check` allows, as where values change with time.
    """

    def __init__(
        self,
        noun: str,
        constants: "Mapping[str, Constant]",
        error: Callable[[str], Exception],
        wording: Wording,
        ranged: "Collection[str]" = (),
        owners: Owners = Owners((), ()),  # noqa: B008 (it does not change)
        reader: Optional["Reader"] = None,
    ) -> None:
        self.constants = constants
        self._noun = noun
        self._error = error
        self._wording = wording
        self._ranged = ranged
        self._owners = owners.names
        self._common = owners.common
        self._reader = reader

    def parse(self, text: str) -> Dict[str, Dict[str, Any]]:
        """Read a text such as `tilt=40,load=-0.1..0.1,B.fps=60`.

        Returns:
            dict, owner ("" for all) -> dict, key -> list of its value, or of LOW and HIGH, or what
            the reader gives.

        Raises:
            the table's error: naming the key, the value and what is allowed.
        """
        given = {owner: {} for owner in ("",) + tuple(self._owners)}  # type: Owned
        for item in filter(None, (part.strip() for part in text.split(","))):
            written, equals, value = (part.strip() for part in item.partition("="))
            owner, key = self._split(written, item)
            if not equals:
                raise self._error(
                    "{} '{}': write {}={}".format(self._noun, item, written, self._wording.value)
                )
            given[owner][key] = self._values(written, key, value)
        return given

    def _split(self, written: str, item: str) -> Tuple[str, str]:
        """Owner and key of a written key."""
        owner, dot, key = written.rpartition(".") if self._owners else ("", "", written)
        if key not in self.constants:
            known = ", ".join(self.constants)
            raise self._error(self._wording.unknown.format(key=written, item=item, known=known))
        if bool(dot) != bool(owner) or owner and owner not in self._owners:
            raise self._error(
                "{0} '{1}': no {0} '{2}'; known: {3}".format(
                    self._noun, written, owner, ", ".join(self._owners)
                )
            )
        if owner and key in self._common:
            raise self._error(
                "{0} '{1}': all {0}s see the same {2}; write {2}={3}".format(
                    self._noun, written, key, self._wording.value
                )
            )
        return owner, key

    def _values(self, written: str, key: str, text: str) -> Any:
        if self._reader is not None:
            return self._reader(key, text, written)
        if not self._ranged:
            return [self.check(key, text, written)]
        values = [self.check(key, part, written) for part in text.split("..")]
        if len(values) > (2 if key in self._ranged else 1):
            raise self._error(
                "{} {}: '{}' is not a single value{}".format(
                    self._noun, written, text, " or LOW..HIGH" if key in self._ranged else ""
                )
            )
        return values

    def check(self, key: str, text: str, written: Optional[str] = None) -> "Value":
        """Return the value of a constant that is written as `text`.

        Args:
            key: of the constant.
            text: its value as written.
            written: the key with its owner, for messages; None: the key alone.

        Raises:
            the table's error: it is not allowed.
        """
        constant = self.constants[key]
        subject = "{} {} = {}".format(self._noun, written or key, text)
        if constant.kind is str:
            if text not in constant.allowed:
                allowed = ", ".join(constant.allowed)
                raise self._error("{}: must be one of {}".format(subject, allowed))
            return text
        lower, upper = constant.allowed
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not lower <= value <= upper or (constant.kind is int and value != int(value)):
            lower, upper = (self._wording.limit.format(limit) for limit in constant.allowed)
            raise self._error(
                "{}: must be a {} from {} to {}{} ({})".format(
                    subject,
                    "whole number" if constant.kind is int else "number",
                    lower,
                    upper,
                    " " + constant.unit if constant.unit else "",
                    constant.meaning,
                )
            )
        return constant.kind(value)

    def listing(self) -> str:
        """Return what `--help` says of all constants, on one line."""
        return "; ".join(
            "{} ({}{}): {}".format(
                key,
                "not given" if constant.default is None else constant.default,
                " " + constant.unit if constant.unit else "",
                constant.meaning,
            )
            for key, constant in self.constants.items()
        )
