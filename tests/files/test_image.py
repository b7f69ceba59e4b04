"""What a camera wrote into a photo."""

from __future__ import annotations

import math

import pytest
from PIL import ExifTags, Image

from ipman_rs.files import image

EXIF = ExifTags.Base


def photo(path, film: float | None, said: tuple[int, int] | None = (640, 480), size: tuple[int, int] = (640, 480)):
    """A JPEG with a 35 mm equivalent focal length and the size that the camera saw."""
    picture = Image.new("RGB", size, (90, 120, 60))
    exif = picture.getexif()
    tags = exif.get_ifd(ExifTags.IFD.Exif)
    if film is not None:
        tags[EXIF.FocalLengthIn35mmFilm] = film
    if said is not None:
        tags[EXIF.ExifImageWidth], tags[EXIF.ExifImageHeight] = said
    picture.save(path, exif=exif)
    return path


def test_the_focal_length_of_a_35_mm_film(tmp_path):
    # A lens of 43.27 mm sees the film's diagonal as its own length: so many pixels as the image's diagonal.
    expected = 28 / math.hypot(36, 24) * 800
    assert image.focal_length(photo(tmp_path / "a.jpg", 28)) == pytest.approx(expected)
    assert image.focal_length(photo(tmp_path / "turned.jpg", 28, (480, 640))) == pytest.approx(expected)


@pytest.mark.parametrize(("film", "said"), [(None, (640, 480)), (28, (4000, 3000)), (28, None), (0, (640, 480))])
def test_none_without_one_or_of_a_crop(tmp_path, film, said):
    assert image.focal_length(photo(tmp_path / "a.jpg", film, said)) is None


def test_damaged_photos_are_named(tmp_path):
    path = tmp_path / "torn.jpg"
    path.write_bytes(b"\xff\xd8\xff no photo")
    with pytest.raises(ValueError, match="torn.jpg: expected an image"):
        image.focal_length(path)
