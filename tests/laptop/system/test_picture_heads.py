"""What heads of pictures say, and which pictures are not decoded."""

import pytest
from hostile_files import jpeg_of, picture, png_of

from laptop.system.picture_heads import (
    MAX_PICTURE_BYTES,
    PNG,
    InvalidPicture,
    is_picture,
    picture_size,
)


@pytest.mark.parametrize("ending", [".png", ".jpg"])
@pytest.mark.parametrize("whole", [True, False])
def test_the_size_is_in_the_head(ending, whole):
    data = picture(ending)
    assert is_picture(data)
    width, height = picture_size(data, whole)
    assert width == height > 1


@pytest.mark.parametrize("ending", [".png", ".jpg"])
def test_a_head_is_enough_where_that_is_asked(ending):
    cut = picture(ending)[:-40]
    assert picture_size(cut, to_end=False) == picture_size(picture(ending))
    with pytest.raises(InvalidPicture, match="is a picture that is cut off; copy it again"):
        picture_size(cut)


@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize(
    ("data", "reported"),
    [
        (b"", "is empty"),
        (b"no picture", "is neither PNG nor JPEG"),
        (PNG, "is a picture that is cut off"),
        (png_of(30000, 30000), "claims 30000 x 30000 pixels; it may have up to 50 million: make"),
        (png_of(0, 5), "claims 0 x 5 pixels"),
        (jpeg_of(65500, 65500), "claims 65500 x 65500 pixels"),
        (PNG + bytes(MAX_PICTURE_BYTES), "is longer than 40 MB"),
    ],
)
def test_what_may_not_be_decoded_is_refused(data, reported, whole):
    with pytest.raises(InvalidPicture, match=reported) as refused:
        picture_size(data, whole)
    assert "\n" not in str(refused.value)
