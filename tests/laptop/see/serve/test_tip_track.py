import pytest

from laptop.see.serve.tip_track import TipTrack


def test_the_tip_between_two_frames_is_between_its_places():
    track = TipTrack()
    for k in range(10):
        track.add(0.1 * k, (10.0 * k, 5.0))
    place, speed = track.at(0.55)
    assert place == pytest.approx((55.0, 5.0))
    assert speed == pytest.approx(100.0)
    assert track.at(0.95) is None, "nobody has seen that yet"
    track.add(2.0, (0.0, 0.0))
    assert track.at(1.5) is None, "nobody saw it then"
    track.add(9.0, (0.0, 0.0))
    assert track.at(0.55) is None, "that was long ago"
