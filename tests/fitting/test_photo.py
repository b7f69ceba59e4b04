"""MediaPipe on a photo, its landmarks in the package, and images without a person."""

from __future__ import annotations

import sys
from importlib import resources

import numpy as np
import pytest
from PIL import Image

from ipman_rs.data import keypoints
from ipman_rs.fitting import photo

EXAMPLE = resources.files("ipman_rs.fitting") / "examples" / "basketball.json"


@pytest.fixture
def pose():
    pytest.importorskip("mediapipe", reason="mediapipe is the extra photo")


def test_example_is_the_photo(pose, shared):
    found = photo.detect([shared("photo") / "basketball1.png"])
    with resources.as_file(EXAMPLE) as path:
        stored = keypoints.read(path)
    assert stored.names == found.names
    np.testing.assert_array_equal(stored.image_size, [[640, 480]])
    # Pixels and metres: other processors round the network's single precision differently.
    np.testing.assert_allclose(stored.points, found.points, atol=1)
    np.testing.assert_allclose(stored.points_3d, found.points_3d, atol=0.01)


def test_example_is_a_person():
    with resources.as_file(EXAMPLE) as path:
        found = keypoints.read(path)
    height = dict(zip(found.names, found.points[0, :, 1], strict=True))
    order = ["nose", "left_shoulder", "left_hip", "left_knee", "left_ankle", "left_big_toe"]
    assert sorted(order, key=height.__getitem__) == order
    depth = dict(zip(found.names, found.points_3d[0], strict=True))
    assert 0.15 < np.linalg.norm(depth["left_hip"] - depth["right_hip"]) < 0.3  # metres
    assert found.confidence.min() > 0.5


def test_two_photos_are_two_rows(pose, shared, tmp_path):
    path = shared("photo") / "basketball1.png"
    with Image.open(path) as image:
        image.crop((0, 40, 300, 480)).save(tmp_path / "part.png")
    found = photo.detect([path, tmp_path / "part.png"])
    assert found.sources == (str(path), str(tmp_path / "part.png"))
    np.testing.assert_array_equal(found.image_size, [[640, 480], [300, 440]])
    shift = found.points[0, :12] - found.points[1, :12]
    assert np.abs(np.median(shift, axis=0) - [0, 40]).max() < 5


def test_nobody_in_the_photo(pose, tmp_path):
    Image.new("RGB", (200, 300), (90, 120, 60)).save(tmp_path / "meadow.png")
    with pytest.raises(ValueError, match="meadow.png: expected a person, found none"):
        photo.detect([tmp_path / "meadow.png"])


def test_box_around_landmarks():
    points = np.array([[10.0, 20.0], [30.0, 120.0], [20.0, 60.0]])
    assert photo.box_around(points) == pytest.approx((6, 16, 28, 108))  # 4 % of 100 around


def test_boxes_of_several_images(pose, shared, tmp_path):
    path = shared("photo") / "basketball1.png"
    pixels = photo.read(path)
    with photo.boxes() as box:
        whole, part = box(path, pixels), box("part", pixels[40:, :300])
        with pytest.raises(ValueError, match="meadow: expected a person, found none"):
            box("meadow", np.full((300, 200, 3), (90, 120, 60), np.uint8))
    assert whole == photo.box_around(photo.detect([path]).points[0])
    np.testing.assert_allclose(np.subtract(whole, part), [0, 40, 0, 0], atol=8)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: Image.new("L", (1, 1)).save(path), "expected an image of at least 32 × 32 pixels, got 1 × 1"),
        (lambda path: path.write_bytes(b"no image"), "expected an image: "),
        (lambda path: path.write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"), "expected an image: "),
        (lambda path: path.mkdir(), "is a folder"),
    ],
)
def test_images_that_are_none(tmp_path, make, message):
    make(tmp_path / "bad.png")
    with pytest.raises(ValueError, match=f"bad.png: {message}"):
        photo.read(tmp_path / "bad.png")


def test_upright_as_exif_says(tmp_path):
    image = Image.new("RGB", (60, 40))
    exif = image.getexif()
    exif[0x0112] = 6  # turned by a quarter
    image.save(tmp_path / "turned.jpg", exif=exif)
    assert photo.read(tmp_path / "turned.jpg").shape == (60, 40, 3)


def test_without_the_extra(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "mediapipe.python.solutions", None)
    with pytest.raises(ImportError, match=r'pip install "ipman_rs\[photo\]"'):
        photo.detect([tmp_path / "a.png"])


class OneOfParts:
    """A detector that finds a person who fills at least a third of what it is shown, at a place in the image."""

    def __init__(self, whole: np.ndarray, box: tuple[int, int, int, int]):
        self.whole, self.box, self.looks = whole, box, 0

    def process(self, part: np.ndarray):
        from types import SimpleNamespace as Record

        self.looks += 1
        y, x = np.argwhere(self.whole[..., 0] == part[0, 0, 0])[0]  # every pixel of the red channel is another
        left, top, width, height = self.box
        inside = x <= left and y <= top and x + part.shape[1] >= left + width and y + part.shape[0] >= top + height
        if not inside or 3 * height < part.shape[0]:
            return Record(pose_landmarks=None)
        places = np.linspace(0, 1, 33)
        across, down = (left - x + places * width) / part.shape[1], (top - y + places * height) / part.shape[0]
        points = [Record(x=a, y=b, z=0, visibility=1) for a, b in zip(across, down, strict=True)]
        found = Record(landmark=points)
        return Record(pose_landmarks=found, pose_world_landmarks=found)


def test_small_people_are_found_in_parts_of_the_image(monkeypatch):
    whole = np.arange(300 * 400, dtype=np.int64).reshape(300, 400, 1)
    detector = OneOfParts(whole, (250, 180, 20, 60))
    landmarks, _, size = photo._landmarks(detector, "far.png", whole)
    assert size == (400, 300)
    np.testing.assert_allclose(landmarks[[0, -1], :2] * size, [[250, 180], [270, 240]], atol=1e-9)
    assert detector.looks > 2  # the whole, parts, and once more around the person
    alone = OneOfParts(whole, (250, 80, 20, 200))
    photo._landmarks(alone, "near.png", whole)
    assert alone.looks == 1


def test_nobody_in_any_part():
    whole = np.arange(300 * 400, dtype=np.int64).reshape(300, 400, 1)
    with pytest.raises(ValueError, match=r"a.png: expected a person, found none; crop the image around one person"):
        photo._landmarks(OneOfParts(whole, (0, 0, 400, 301)), "a.png", whole)


class TwoPeople(OneOfParts):
    """The same with two people, of whom the nearer to the middle of what is shown is found."""

    def process(self, part: np.ndarray):
        left, right = (OneOfParts(self.whole, box).process(part) for box in ((40, 60, 30, 110), (300, 80, 30, 100)))
        y, x = np.argwhere(self.whole[..., 0] == part[0, 0, 0])[0]
        near_left = abs(x + part.shape[1] / 2 - 55) < abs(x + part.shape[1] / 2 - 315)
        first, second = (left, right) if near_left else (right, left)
        return first if first.pose_landmarks is not None else second


def test_everyone_in_an_image():
    whole = np.arange(300 * 400, dtype=np.int64).reshape(300, 400, 1)
    people = photo._look_for_everyone(TwoPeople(whole, (0, 0, 0, 0)), whole)
    boxes = [(*(one[0][:, :2].min(axis=0) * (400, 300)), *(one[0][:, :2].max(axis=0) * (400, 300))) for one in people]
    np.testing.assert_allclose(boxes, [(40, 60, 70, 170), (300, 80, 330, 180)], atol=1e-9)
