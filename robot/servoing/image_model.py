"""What is known of the image at one moment.  Pure.

q   joint angles, rad (n)
s   image features, px (m)
J   image Jacobian ds/dq, px/rad: m rows, n columns
"""

from operator import mul

from shared.record import record


class LocalImageModel(record("LocalImageModel", "predict jacobian")):
    """What a model knows at one moment, seen from one pose.

    predict(q)   s that will be seen at q, px
    jacobian(q)  J there, px/rad
    """

    __slots__ = ()


class LinearImageModel(object):
    """A LocalImageModel that is linear in the terms of a chain: s = W terms(q) + offset.

    Args:
        chain: Chain.
        joints: how many.
        W: m rows, px.
        offset: m, px.
    """

    def __init__(self, chain, joints, W, offset):
        self._chain, self._joints = chain, joints
        self.W, self.offset = W, offset
        self._q = self._terms = self._J = None  # where it was asked for last, which it is again

    def at_once(self, W, offset):
        """One of other rows, by the same chain."""
        return LinearImageModel(self._chain, self._joints, W, offset)

    def moved(self, offset):
        """The same, elsewhere in the image."""
        return LinearImageModel(self._chain, self._joints, self.W, offset)

    def _at(self, q):
        if self._q != q:
            self._q, self._terms, self._J = list(q), self._chain.terms(q), None

    def predict(self, q):
        """As LocalImageModel's."""
        self._at(q)
        terms = self._terms
        return [sum(map(mul, w, terms), o) for w, o in zip(self.W, self.offset)]

    def jacobian(self, q):
        """As LocalImageModel's."""
        self._at(q)
        if self._J is None:
            if self._chain.slopes is None:
                self._J = self.W
            else:
                columns = self._chain.slopes(self._terms, self._joints)
                self._J = tuple([[sum(map(mul, w, column)) for column in columns] for w in self.W])
        return self._J


Chain = record("Chain", "terms slopes axes")
Chain.__doc__ = """Functions in whose results the image is linear.

terms(q)               of joint angles (rad): a list of numbers, the first of which is 1
slopes(terms, joints)  their derivatives by q: a list per joint; None if the terms are q itself
axes(links)            of the links' lengths (cm): the tip's place along the axes of space, cm, as
                       coefficients of the terms
"""

_STRAIGHT = Chain(list, None, None)
"""Joints of which nothing is known but J: the image is linear in their angles."""


def straight(J, offset=None):
    """A LinearImageModel of the joints' angles themselves: s = J q + offset (0 if None), px."""
    return LinearImageModel(_STRAIGHT, len(J[0]), J, offset or [0.0] * len(J))


def stacked(images):
    """One LocalImageModel of several cameras, their rows in turn.

    Args:
        images: [(LocalImageModel, slice of its rows that counts, their weight)].
    """
    first, rows, weight = images[0]
    if len(images) == 1 and rows == slice(0, 2) and weight == 1.0:
        return first
    if all(isinstance(image, LinearImageModel) for image, _, _ in images):
        W, offset = [], []
        for image, rows, weight in images:
            W += [[weight * a for a in w] for w in image.W[rows]]
            offset += [weight * o for o in image.offset[rows]]
        return first.at_once(W, offset)

    def predict(q):
        return [w * y for image, rows, w in images for y in image.predict(q)[rows]]

    def jacobian(q):
        return tuple(
            [[w * a for a in row] for image, rows, w in images for row in image.jacobian(q)[rows]]
        )

    return LocalImageModel(predict, jacobian)
