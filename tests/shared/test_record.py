"""A record is a named tuple: all that the programs ask of one, both do alike."""

import copy
import pickle
from collections import namedtuple

import pytest

from shared.messages import Observation, Ping, Start
from shared.record import record

Point = record("Point", "x y z", defaults=[0.0])
Named = namedtuple("Named", "x y z")
Named.__new__.__defaults__ = (0.0,)


class Shifted(record("Shifted", "x y")):
    """One with a default of its own making."""

    __slots__ = ()

    def __new__(cls, x, y=None):
        return super().__new__(cls, x, [] if y is None else y)


BOTH = pytest.mark.parametrize("kind", [Point, Named])


@BOTH
def test_it_is_a_tuple_with_names(kind):
    point = kind(1, 2, 3)
    assert point == (1, 2, 3)
    assert hash(point) == hash((1, 2, 3))
    assert (point.x, point.y, point.z) == (1, 2, 3)
    x, y, z = point
    assert (x, y, z) == (1, 2, 3)
    assert kind._fields == ("x", "y", "z")
    assert kind._make(iter([4, 5, 6])) == (4, 5, 6)


@BOTH
def test_values_come_in_order_by_name_or_by_default(kind):
    assert kind(z=3, x=1, y=2) == kind(1, y=2, z=3) == (1, 2, 3)
    assert kind(1, 2) == (1, 2, 0.0)


@BOTH
@pytest.mark.parametrize(
    ("values", "named", "says"),
    [
        ((1,), {}, "missing 1 required positional argument: 'y'"),
        ((1, 2, 3, 4), {}, "positional arguments but 5 were given"),
        ((1, 2), {"x": 1}, "multiple values for argument 'x'"),
        ((1, 2), {"w": 1}, "unexpected keyword argument 'w'"),
    ],
)
def test_values_that_do_not_fit_are_refused(kind, values, named, says):
    with pytest.raises(TypeError, match=says):
        kind(*values, **named)


@BOTH
def test_a_changed_copy(kind):
    assert kind(1, 2, 3)._replace(y=5) == kind(1, 5, 3)
    assert type(kind(1, 2, 3)._replace()) is kind
    with pytest.raises((TypeError, ValueError), match=r"\bw\b"):
        kind(1, 2, 3)._replace(w=5)


@BOTH
def test_names_and_values_in_order(kind):
    assert list(kind(1, 2, 3)._asdict().items()) == [("x", 1), ("y", 2), ("z", 3)]


@BOTH
def test_nothing_can_be_set(kind):
    point = kind(1, 2, 3)
    for name in ("x", "w"):
        with pytest.raises(AttributeError):
            setattr(point, name, 5)
    assert not hasattr(point, "__dict__")


@BOTH
def test_it_shows_its_names(kind):
    assert repr(kind(1, "two", (3,))) == kind.__name__ + "(x=1, y='two', z=(3,))"


@pytest.mark.parametrize("one", [Ping(3), Observation(1, "A", 0.5, {}), Start(goals={"A": (1, 2)})])
def test_copies_are_equal_and_of_the_same_class(one):
    copies = [copy.copy(one), copy.deepcopy(one)]
    copies += [pickle.loads(pickle.dumps(one, n)) for n in range(2, pickle.HIGHEST_PROTOCOL + 1)]
    assert copies == [one] * len(copies)
    assert {type(other) for other in copies} == {type(one)}


def test_a_class_of_its_own_may_make_its_defaults():
    assert Shifted(1) == (1, [])
    assert Shifted(1).y is not Shifted(1).y
    assert Shifted(1)._replace(x=2) == (2, [])
    assert repr(Shifted(1, 2)) == "Shifted(x=1, y=2)"
    assert not hasattr(Shifted(1), "__dict__")


def test_it_says_where_it_was_made():
    assert (Point.__name__, Point.__module__) == ("Point", __name__)
    Point.__doc__ = "A place."
    assert Point.__doc__ == "A place."
