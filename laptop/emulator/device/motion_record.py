"""The motion of an emulated arm, sample by sample; an arm that stands takes no more memory."""

from bisect import bisect_right
from typing import Callable, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union, overload

MYPY = False
if MYPY:
    # Of a sample without its time: joint angles, x, y, z and the pen.
    Place = Tuple[Tuple[float, ...], float, float, Optional[float], int]


MotionSample = NamedTuple(
    "MotionSample",
    [
        ("t", float),
        ("q", Tuple[float, ...]),
        ("x", float),
        ("y", float),
        ("z", Optional[float]),
        ("pen", int),
    ],
)
MotionSample.__doc__ = """A pose of the arm at a time.

Attributes:
    t: s.
    q: joint angles, rad.
    x: of the tip, cm.
    y: of the tip, cm.
    z: of the tip, cm; None in the plane.
    pen: 1 if it is down.
"""


class MotionRecord(Sequence[MotionSample]):
    """The MotionSamples of a run, one per period; others can be added.

    Only samples that differ from the one before are stored; times follow from the number.

    Args:
        time_of: from a sample's number, from 0 on, to its time, s.
    """

    def __init__(self, time_of: Callable[[int], float]) -> None:
        self._time_of = time_of
        self._length = 0
        self._begins = []  # type: List[int]  # numbers of the first of samples that are alike
        self._places = []  # type: List[Place]

    def append(
        self, q: Tuple[float, ...], x: float, y: float, z: Optional[float], pen: int
    ) -> None:
        """Add the next sample: joint angles q, rad, the tip, cm, and 1 where the pen is down."""
        place = q, x, y, z, pen
        if not self._places or self._places[-1] != place:
            self._begins.append(self._length)
            self._places.append(place)
        self._length += 1

    def since(self, first: int) -> "MotionRecord":
        """Return the samples from this number on, as a record that does not grow with this one."""
        time_of = self._time_of
        out = MotionRecord(lambda number: time_of(first + number))
        k = max(0, bisect_right(self._begins, first) - 1)
        out._length = self._length - first
        out._begins = [max(0, begin - first) for begin in self._begins[k:]]
        out._places = self._places[k:]
        return out

    def __len__(self) -> int:
        return self._length

    @overload
    def __getitem__(self, index: int) -> MotionSample: ...

    @overload
    def __getitem__(self, index: slice) -> List[MotionSample]: ...

    def __getitem__(self, index: Union[int, slice]) -> Union[MotionSample, List[MotionSample]]:
        if isinstance(index, slice):
            numbers = range(*index.indices(self._length))
            if numbers.step > 0:
                return list(self._between(numbers))
            return [self[number] for number in numbers]
        number = index + self._length if index < 0 else index
        if not 0 <= number < self._length:
            raise IndexError("there are {} samples".format(self._length))
        place = self._places[bisect_right(self._begins, number) - 1]
        return MotionSample(self._time_of(number), *place)

    def __iter__(self) -> Iterator[MotionSample]:
        return self._between(range(self._length))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MotionRecord):
            return NotImplemented
        return (self._length, self._begins, self._places) == (
            other._length,
            other._begins,
            other._places,
        )

    __hash__ = None  # type: ignore[assignment]  # it grows

    def _between(self, numbers: range) -> Iterator[MotionSample]:
        """Iterate over samples of rising numbers."""
        k = bisect_right(self._begins, numbers.start) - 1
        for number in numbers:
            while k + 1 < len(self._begins) and self._begins[k + 1] <= number:
                k += 1
            yield MotionSample(self._time_of(number), *self._places[k])
