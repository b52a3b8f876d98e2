"""What is known of the image at one moment.  Pure.

q   joint angles, rad (n)
s   image features, px (m)
J   image Jacobian ds/dq, px/rad: m rows, n columns
"""

from operator import mul

from shared.record import record


class LinearImageModel(object):
    """What a model knows at one moment, linear in the terms of a chain: s = W terms(q) + offset.

    Args:
        chain: Chain.
        W: m rows, px.
        offset: m, px.
    """

    def __init__(self, chain, W, offset):
        self._chain = chain
        self.W, self.offset = W, offset
        # Where it was asked for last, which it is again.
        self._q, self._terms, self._J = None, (), None

    def with_rows(self, W, offset):
        """One of other rows, by the same chain."""
        return LinearImageModel(self._chain, W, offset)

    def moved(self, offset):
        """The same, elsewhere in the image."""
        return LinearImageModel(self._chain, self.W, offset)

    def _at(self, q):
        if self._q != q:
            self._q, self._terms, self._J = list(q), self._chain.terms(q), None

    def predict(self, q):
        """s that will be seen at q, px."""
        self._at(q)
        terms = self._terms
        return [sum(map(mul, w, terms), o) for w, o in zip(self.W, self.offset)]

    def jacobian(self, q):
        """J at q, px/rad."""
        self._at(q)
        if self._J is None:
            self._J = self._chain.jacobian(self._terms, self.W)
        return self._J


Chain = record("Chain", "terms jacobian")
Chain.__doc__ = """Functions in whose results the image is linear.

terms(q)            of joint angles (rad): a list of numbers, the first of which is 1
jacobian(terms, W)  the image Jacobian there, m rows, that comes of it
"""

_STRAIGHT = Chain(list, lambda q, W: W)
"""Joints of which nothing is known but J: the image is linear in their angles."""


def straight(J, offset=None):
    """A LinearImageModel of the joints' angles themselves: s = J q + offset (0 if None), px."""
    return LinearImageModel(_STRAIGHT, J, offset or [0.0] * len(J))


def stacked(images):
    """One LinearImageModel of several cameras, their rows in turn.

    Args:
        images: [(LinearImageModel, slice of its rows that counts, their weight)], of one chain.
    """
    first, rows, weight = images[0]
    if len(images) == 1 and rows == slice(0, 2) and weight == 1.0:
        return first
    W, offset = [], []
    for image, rows, weight in images:
        W += [[weight * a for a in w] for w in image.W[rows]]
        offset += [weight * o for o in image.offset[rows]]
    return first.with_rows(W, offset)
