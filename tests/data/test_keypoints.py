"""Keypoint files: every format's points under their names, and clear words for what is wrong in a file."""

from __future__ import annotations

import json

import numpy as np
import pytest

from ipman_rs.data import keypoints
from ipman_rs.data.keypoints import coco, coco_wholebody, mediapipe, openpose
from ipman_rs.data.keypoints.detections import Detections, join


def flat(count, scale=1.0, start=0):
    """Points (10 k, 10 k + 5), confidence 0.5."""
    return [number for k in range(start, start + count) for number in (10.0 * k * scale, (10.0 * k + 5) * scale, 0.5)]


@pytest.fixture
def written(tmp_path):
    def write(content, name="some.json"):
        path = tmp_path / name
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    return write


def point(detections, name, row=0):
    column = detections.names.index(name)
    return (*detections.points[row, column], detections.confidence[row, column])


def nth(k):
    return 10 * k, 10 * k + 5, 0.5


def test_openpose(written):
    path = written({"version": 1.3, "people": [{"pose_keypoints_2d": flat(25), "hand_left_keypoints_2d": []}]})
    found = keypoints.read(path)
    places = {"nose": 0, "mid_shoulder": 1, "right_shoulder": 2, "left_wrist": 7, "mid_hip": 8, "right_hip": 9}
    places |= {"left_ankle": 14, "right_eye": 15, "left_ear": 18, "left_big_toe": 19, "left_small_toe": 20}
    places |= {"left_heel": 21, "right_big_toe": 22, "right_small_toe": 23, "right_heel": 24}
    for name, k in places.items():
        assert point(found, name) == nth(k)
    assert point(found, "left_index_tip") == (0, 0, 0)  # no hands: not seen
    assert found.image_size is None
    assert found.sources == (str(path),)


def test_openpose_hands(written):
    found = keypoints.read(
        written({"people": [{"pose_keypoints_2d": flat(25), "hand_right_keypoints_2d": flat(21, start=50)}]})
    )
    assert point(found, "right_thumb1") == nth(51)
    assert point(found, "right_index_tip") == nth(58)
    assert point(found, "right_pinky1") == nth(67)
    assert point(found, "left_pinky1") == (0, 0, 0)


def test_the_largest_and_most_confident_of_several(written):
    small, large = flat(25, 0.3), flat(25)
    path = written({"people": [{"pose_keypoints_2d": small}, {"pose_keypoints_2d": large}]})
    found = keypoints.read(path)
    assert point(found, "left_ear") == nth(18)
    assert found.notes == (f"{path}: 2 people; took number 1, the largest and most confident",)
    first = keypoints.read(path, person=0)
    assert point(first, "left_ear")[0] == pytest.approx(54)
    assert first.notes == ()
    with pytest.raises(ValueError, match="person: expected 0 to 1 in .*some.json, got 2"):
        keypoints.read(path, person=2)


def test_coco_annotations(written):
    people = [
        {"image_id": 7, "num_keypoints": 0, "keypoints": [0] * 51},
        {"image_id": 9, "num_keypoints": 17, "keypoints": [v for k in range(17) for v in (k, 2 * k, k % 3)]},
        {"image_id": 8, "num_keypoints": 17, "keypoints": flat(17)},
    ]
    images = [{"id": 8, "file_name": "b.jpg", "width": 640, "height": 480}]
    images += [{"id": 9, "file_name": "a.jpg", "width": 320, "height": 240}]
    path = written({"images": images, "annotations": people})
    found = keypoints.read(path)
    assert found.sources == (f"{path}: a.jpg", f"{path}: b.jpg")
    np.testing.assert_array_equal(found.image_size, [[320, 240], [640, 480]])
    assert point(found, "right_ankle", 0) == (16, 32, 1)  # flags: 0 not labelled, 1 hidden, 2 visible
    assert point(found, "left_ear", 0)[2] == 0
    assert point(found, "left_shoulder", 1) == nth(5)
    assert keypoints.read(path, image_size=(10, 20)).image_size.tolist() == [[10, 20]] * 2


@pytest.mark.parametrize(
    "content",
    [
        [{"image_id": 1, "keypoints": flat(17), "score": 0.9}],
        {"keypoints": flat(17)},
        {"keypoints": np.reshape(flat(17), (17, 3)).tolist()},
        [{"keypoints": np.reshape(flat(17), (17, 3))[:, :2].tolist(), "keypoint_scores": [0.5] * 17}],
    ],
)
def test_other_forms_of_coco(written, content):
    found = keypoints.read(written(content))
    assert found.names == coco.NAMES
    assert [point(found, name) for name in ("nose", "left_hip", "right_ankle")] == [nth(0), nth(11), nth(16)]


def test_wholebody_in_one_list_and_in_parts(written):
    whole = flat(133)
    cut = np.cumsum([0, 17, 6, 68, 21, 21]) * 3
    fields = ("keypoints", "foot_kpts", "face_kpts", "lefthand_kpts", "righthand_kpts")
    parts = {field: whole[start:end] for field, start, end in zip(fields, cut, cut[1:], strict=False)}
    assert cut[-1] == len(whole)
    for content in ({"keypoints": whole}, {"annotations": [{"image_id": 3, **parts}]}):
        found = keypoints.read(written(content))
        assert point(found, "left_big_toe") == nth(17)
        assert point(found, "right_heel") == nth(22)
        assert point(found, "left_thumb1") == nth(92)
        assert point(found, "right_pinky_tip") == nth(132)
        assert len(found.names) == 17 + 6 + 20 + 20


def mediapipe_points(width=1.0, height=1.0):
    return [{"x": k / 40 * width, "y": k / 50 * height, "z": 0.1, "visibility": 0.9} for k in range(33)]


@pytest.mark.parametrize(
    "content",
    [
        {"image_size": [400, 500], "landmarks": [list(p.values()) for p in mediapipe_points()]},
        {"image_size": [400, 500], "pose_landmarks": {"landmark": mediapipe_points()}},
        {"image_size": [400, 500], "poseLandmarks": [mediapipe_points()]},
        {"image_size": [400, 500], "landmarks": mediapipe_points(400, 500)},  # pixels
    ],
)
def test_mediapipe(written, content):
    found = keypoints.read(written(content))
    assert point(found, "nose") == (0, 0, 0.9)
    assert point(found, "right_hip") == pytest.approx((240, 240, 0.9))
    assert point(found, "left_big_toe") == pytest.approx((310, 310, 0.9))
    assert point(found, "right_index") == pytest.approx((200, 200, 0.9))
    assert found.points_3d is None


def test_mediapipe_written_and_read(tmp_path):
    rng = np.random.default_rng(4)
    image, world = rng.uniform(0, 1, (33, 4)).round(5), rng.uniform(0, 1, (33, 4)).round(5)
    mediapipe.write(tmp_path / "x.json", "x.png", (640, 480), image, world)
    found = keypoints.read(tmp_path / "x.json")
    kept = [index for index, name in enumerate(mediapipe.NAMES) if name]
    np.testing.assert_allclose(found.points[0], image[kept, :2] * [640, 480], atol=1e-9)
    np.testing.assert_array_equal(found.points_3d[0], world[kept, :3])
    np.testing.assert_array_equal(found.confidence_3d[0], world[kept, 3])


def test_relative_points_need_an_image_size(written):
    path = written(mediapipe_points())
    with pytest.raises(ValueError, match="some.json: image_size: .* look relative to the image and need it"):
        keypoints.read(path)
    assert point(keypoints.read(path, image_size=(400, 500)), "right_hip") == pytest.approx((240, 240, 0.9))


def with_nan():
    numbers = flat(25)
    numbers[7] = float("nan")
    return {"people": [{"pose_keypoints_2d": numbers}]}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('{"people": [', "some.json: is no JSON: "),
        ("[" * 100_000, "some.json: is no JSON: "),
        ({"people": []}, "some.json: expected a person, got none"),
        ({"people": 3}, "people: expected a list, got int"),
        ({"annotations": []}, "some.json: expected a person, got none"),
        ({"people": [{}]}, r"people\[0\]: expected pose_keypoints_2d, got none"),
        (
            {"people": [{"pose_keypoints_2d": flat(19)}]},
            r"people\[0\]: pose_keypoints_2d: expected 25 \(BODY_25\), 18 \(COCO\) or 15 \(MPI\) points .* got 19",
        ),
        ({"people": [{"pose_keypoints_2d": ["a"] * 75}]}, "expected numbers, got something else"),
        (
            {"people": [{"pose_keypoints_2d": [0] * 75}]},
            "person 0: expected a point with confidence above 0, all have 0",
        ),
        ({"people": [{"pose_keypoints_2d": [50] * 75}]}, "expected confidences of 0 to 1, got 0 to 50"),
        (with_nan(), r"some.json: people\[0\]: pose_keypoints_2d: point 2: expected finite numbers, got nan"),
        (
            {"keypoints": [1, 2, 3]},
            r"annotations\[0\]: keypoints: expected 17 \(COCO\), .* points of x, y and score, got 1 of 3 numbers",
        ),
        ({"keypoints": [None] * 51}, "expected a point with confidence above 0, all have 0"),
        ({"landmarks": mediapipe_points()[:20], "image_size": [4, 5]}, "landmarks: expected 33 points"),
        ({"landmarks": [{"y": 1}] * 33, "image_size": [4, 5]}, r"landmarks\[0\]: expected x and y, got y"),
        ({"landmarks": mediapipe_points(), "image_size": [0, 5]}, "image_size: expected width and height above 0"),
        ({"landmarks": [], "image_size": [4, 5]}, "some.json: expected a person, got none"),
        ({"shapes": []}, "expected keypoints in one of the formats openpose, mmpose, coco-wholebody, coco, mediapipe"),
        (3, "expected keypoints in one of the formats"),
    ],
)
def test_what_is_wrong_in_a_file(written, content, message):
    with pytest.raises(ValueError, match=message):
        keypoints.read(written(content))


def test_files_that_are_none(tmp_path):
    with pytest.raises(ValueError, match="none.json: there is no such file"):
        keypoints.read(tmp_path / "none.json")
    (tmp_path / "image.json").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(ValueError, match="image.json: is no JSON: it is no text"):
        keypoints.read(tmp_path / "image.json")


def test_a_format_that_was_asked_for(written):
    path = written({"keypoints": flat(17)})
    assert len(keypoints.read(path, format="coco").names) == 17
    with pytest.raises(ValueError, match="some.json: expected the format openpose, got something else"):
        keypoints.read(path, format="openpose")
    with pytest.raises(ValueError, match="format: expected one of openpose, mmpose, .* got 'bvh'"):
        keypoints.read(path, format="bvh")


def test_formats_name_their_points_once():
    for reader in (openpose, coco, coco_wholebody, mediapipe):
        named = [name for name in reader.NAMES if name]
        assert len(named) == len(set(named))
        assert {name.replace("left", "right") for name in named} <= set(named)


def test_join_and_select(written):
    one = keypoints.read(written({"keypoints": flat(17)}, "a.json"), image_size=(100, 200))
    path = written({"people": [{"pose_keypoints_2d": flat(25)}]}, "b.json")
    both = join([one, keypoints.read(path, image_size=(300, 400))])
    assert len(both) == 2
    assert point(both, "left_hip", 0) == nth(11)
    assert point(both, "left_hip", 1) == nth(12)
    assert point(both, "left_heel", 0) == (0, 0, 0)
    np.testing.assert_array_equal(both.image_size, [[100, 200], [300, 400]])
    chosen = both.select(["left_heel", "tail"])
    assert point(chosen, "left_heel", 1) == nth(21)
    assert point(chosen, "tail", 1) == (0, 0, 0)
    with pytest.raises(ValueError, match="image_size: some detections come with one"):
        join([one, keypoints.read(path)])


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"points": np.zeros((1, 3, 2))}, r"points: expected shape \(1, 2, 2\), got \(1, 3, 2\)"),
        ({"points": np.full((1, 2, 2), np.nan)}, "points: expected finite numbers"),
        ({"confidence": np.full((1, 2), 1.5)}, "confidence: expected 0 to 1, got 1.5 to 1.5"),
    ],
)
def test_detections_are_checked(changed, message):
    good = {"names": ("a", "b"), "points": np.zeros((1, 2, 2)), "confidence": np.ones((1, 2)), "sources": ("x",)}
    with pytest.raises(ValueError, match=message):
        Detections(**{**good, **changed})
