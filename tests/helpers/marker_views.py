"""Pictures of lone markers, as tests write them: all that may differ, by its name."""

from laptop.emulator.scene import marker_pictures
from laptop.emulator.scene.sensor import Development


def marker_frame(
    kind, u, v, radius, colour="red", background="#808080", size=(128, 128), *,
    motion=(0.0, 0.0), number=0, seed=0, **development
):  # fmt: skip
    """As laptop.emulator.scene.marker_pictures.marker_frame; `development` is of Development."""
    return marker_pictures.marker_frame(
        marker_pictures.LoneMarker(kind, radius, colour, number),
        (u, v),
        background,
        size,
        motion,
        Development(**development),
        seed,
    )
