"""The image of one or several cameras as it is known at one moment.  Pure.

q   joint angles, rad (n)
s   image features, px (m)
J   image Jacobian ds/dq, px/rad: m rows, n columns
"""

from operator import mul

from shared.record import record

MYPY = False  # which a type checker takes for true
if MYPY:
    from typing import Callable, List, NamedTuple, Optional, Sequence, Tuple  # noqa: F401

    from robot.servoing.linear_algebra import Matrix, Vector  # noqa: F401

    Pose = Sequence[float]  # joint angles q, rad (n)
    Features = Sequence[float]  # image features s, px (m)
    Pixel = Tuple[float, float]  # u and v of one camera, px


class LinearImageModel(object):
    """An image model that is linear in the terms of a chain: s = W terms(q) + offset.

    Args:
        chain: Chain.
        W: coefficients of the terms, px: m rows.
        offset: px (m).
    """

    def __init__(self, chain, W, offset):
        # type: (Chain, Matrix, Vector) -> None
        self._chain = chain
        self.W, self.offset = W, offset
        # Where it was asked for last, which it is again.
        self._q = None  # type: Optional[List[float]]
        self._terms = ()  # type: Vector
        self._J = None  # type: Optional[Matrix]

    def with_rows(self, W, offset):
        # type: (Matrix, Vector) -> LinearImageModel
        """Return one of other rows, by the same chain."""
        return LinearImageModel(self._chain, W, offset)

    def moved(self, offset):
        # type: (Vector) -> LinearImageModel
        """Return the same with another offset, px (m)."""
        return LinearImageModel(self._chain, self.W, offset)

    def terms(self, q):
        # type: (Pose) -> Vector
        """Return the chain's terms at q (rad), in which the image is linear."""
        return self._chain.terms(q)

    def _at(self, q):
        # type: (Pose) -> None
        """Evaluate the terms at q (rad), unless they are of there."""
        if self._q != q:
            self._q, self._terms, self._J = list(q), self._chain.terms(q), None

    def predict(self, q):
        # type: (Pose) -> List[float]
        """Return the s that will be seen at q (rad), px (m)."""
        self._at(q)
        terms = self._terms
        return [sum(map(mul, w, terms), o) for w, o in zip(self.W, self.offset)]

    def jacobian(self, q):
        # type: (Pose) -> Matrix
        """Return J at q (rad), px/rad: m rows, n columns."""
        self._at(q)
        if self._J is None:
            self._J = self._chain.jacobian(self._terms, self.W)
        return self._J


if MYPY:
    Chain = NamedTuple(
        "Chain",
        [("terms", Callable[[Pose], Vector]), ("jacobian", Callable[[Vector, Matrix], Matrix])],
    )
else:
    Chain = record("Chain", "terms jacobian")
Chain.__doc__ = """Functions in whose results the image is linear.

terms(q)            of joint angles (rad): a list of numbers, the first of which is 1
jacobian(terms, W)  the image Jacobian there, m rows, that comes of it
"""

_STRAIGHT = Chain(list, lambda q, W: W)
"""Chain of joints of which nothing is known but J: the image is linear in their angles."""


def straight(J, offset=None):
    # type: (Matrix, Optional[Vector]) -> LinearImageModel
    """Return a LinearImageModel of the joint angles themselves: s = J q + offset.

    Args:
        J: px/rad: m rows, n columns.
        offset: px (m); zeros if None.
    """
    return LinearImageModel(_STRAIGHT, J, offset or [0.0] * len(J))


def stacked(images):
    # type: (Sequence[Tuple[LinearImageModel, slice, float]]) -> LinearImageModel
    """Return one LinearImageModel of several cameras, their rows in turn.

    Args:
        images: [(LinearImageModel, slice of its rows that counts, their weight)], of one chain.
    """
    first, rows, weight = images[0]
    if len(images) == 1 and rows == slice(0, 2) and weight == 1.0:
        return first
    W, offset = [], []  # type: List[Vector], List[float]
    for image, rows, weight in images:
        W += [[weight * a for a in w] for w in image.W[rows]]
        offset += [weight * o for o in image.offset[rows]]
    return first.with_rows(W, offset)
