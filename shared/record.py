"""Named tuples that cost the brick's Python next to nothing to define, and less to make.

`collections.namedtuple` of Python 3.5 compiles a page of text for each class, which takes 1.9 M
instructions; `record` takes 0.2 M.  The result can do the same.
"""

import sys
from operator import itemgetter

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Any, Dict, Iterable, Sequence, Tuple, Type, TypeVar  # noqa: F401

    Self = TypeVar("Self", bound="Record")
    Values = Tuple[Any, ...]
else:
    Values = tuple


class Record(Values):
    """Base of what `record` makes: a tuple whose elements also have names."""

    __slots__ = ()
    _fields = ()  # type: Tuple[str, ...]

    @classmethod
    def _make(cls, values):
        # type: (Type[Self], Iterable[Any]) -> Self
        """Make a record from its values in order."""
        return cls(*values)

    def _replace(self, **changed):
        # type: (Self, **Any) -> Self
        """Return a copy with other values for some fields."""
        result = self._make([changed.pop(field, own) for field, own in zip(self._fields, self)])
        if changed:
            raise ValueError("{} has no {}".format(type(self).__name__, ", ".join(sorted(changed))))
        return result

    def _asdict(self):
        # type: () -> Dict[str, Any]
        """Return an OrderedDict of names and values."""
        from collections import OrderedDict  # not above: few ask for it

        return OrderedDict(zip(self._fields, self))

    def __repr__(self):
        # type: () -> str
        pairs = zip(self._fields, self)
        return "{}({})".format(
            type(self).__name__, ", ".join("{}={!r}".format(*pair) for pair in pairs)
        )

    def __getnewargs__(self):  # for copying and pickling
        # type: () -> Values
        return tuple(self)


if MYPY:
    from collections import namedtuple as record

    __all__ = ["Record", "record"]
else:

    def record(name, fields, defaults=()):
        # type: (str, str, Sequence[object]) -> type
        """Make a class of tuples with named elements, as `collections.namedtuple` does.

        Args:
            name: of the class.
            fields: names of the elements, in one text.
            defaults: values of the last fields, where none is given.
        """
        fields = tuple(fields.split())
        # The one thing to be compiled, so that Python itself sorts arguments into their places.
        new = eval(
            "lambda _class, {0}: _new(_class, ({0},))".format(", ".join(fields)),
            {"_new": tuple.__new__},
        )
        new.__name__ = "__new__"
        new.__qualname__ = name + ".__new__"
        new.__defaults__ = tuple(defaults)
        body = {field: property(itemgetter(place)) for place, field in enumerate(fields)}
        body.update(
            __slots__=(),
            _fields=fields,
            __new__=new,
            __module__=sys._getframe(1).f_globals["__name__"],  # where a pickle looks for it
        )
        return type(name, (Record,), body)
