"""What an emulated camera shows of numbered pictures."""

from itertools import count

import pytest

from laptop.emulator.picture_faults import PictureFaults


class Camera:
    """It takes 0, 1, 2, ..."""

    def __init__(self, pictures, name="A"):
        self.name, self.pictures, self._number = name, pictures, count()

    def show(self, times):
        return [self.pictures.shown(self.name, lambda: next(self._number)) for _ in range(times)]


def test_without_a_fault_each_picture_is_shown_once():
    assert Camera(PictureFaults()).show(4) == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("frames", "shown"),
    [(1, [3, 3, 3, 3, 3]), (2, [2, 3, 2, 3, 2]), (3, [1, 2, 3, 1, 2]), (9, [0, 1, 2, 3, 0])],
)
def test_the_last_pictures_come_again_and_then_new_ones(frames, shown):
    pictures = PictureFaults()
    camera = Camera(pictures)
    assert camera.show(4) == [0, 1, 2, 3]
    pictures.freeze(frames=frames)
    assert camera.show(5) == shown
    pictures.release()
    assert camera.show(2) == [4, 5], "what nobody saw was not taken"


def test_one_camera_alone_is_frozen():
    pictures = PictureFaults()
    cameras = Camera(pictures), Camera(pictures, "B")
    assert [camera.show(2) for camera in cameras] == [[0, 1], [0, 1]]
    pictures.freeze("B")
    assert [camera.show(2) for camera in cameras] == [[2, 3], [1, 1]]
    pictures.release("B")
    assert [camera.show(2) for camera in cameras] == [[4, 5], [2, 3]]


def test_each_picture_is_shown_several_times():
    pictures = PictureFaults()
    camera = Camera(pictures)
    pictures.repeat(3)
    assert camera.show(7) == [0, 0, 0, 1, 1, 1, 2]
    pictures.release()
    assert camera.show(2) == [3, 4]


@pytest.mark.parametrize("frames", [0, 121])
def test_a_loop_that_cannot_be_is_refused(frames):
    with pytest.raises(ValueError, match=f"a loop of {frames} pictures"):
        PictureFaults().freeze(frames=frames)
