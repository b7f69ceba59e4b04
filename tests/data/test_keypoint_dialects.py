"""Keypoint files as trackers write them: the same person in every dialect, and damaged files in one line."""

from __future__ import annotations

import json
import random

import numpy as np
import pytest

from ipman_rs.data import keypoints
from ipman_rs.data.keypoints import layouts, mediapipe, openpose

SIZE = (640, 480)
# A person who stands, in pixels, by COCO's order: the numbers are our own.
COCO = np.array(
    [
        [320, 90], [326, 84], [314, 84], [334, 88], [306, 88], [350, 140], [290, 140], [362, 200], [278, 200],
        [366, 255], [274, 255], [338, 260], [302, 260], [340, 340], [300, 340], [342, 420], [298, 420],
    ],
    float,
)  # fmt: skip
WHERE = dict(zip(layouts.COCO_17, COCO, strict=True))
SCORES = np.linspace(0.6, 1.0, 17)


def of_layout(names, start=0.0):
    """Points (K, 3) of a layout: the person's where COCO has them, others at places of their own."""
    own = [[100.0 + start + 3 * row, 200.0 + start + 2 * row] for row in range(len(names))]
    return np.array([[*WHERE.get(name or "", place), 0.9] for name, place in zip(names, own, strict=True)])


def instance(scale=1.0, **more):
    """A person as MMPose writes one."""
    points = (COCO * scale).tolist()
    return {"keypoints": points, "keypoint_scores": SCORES.tolist(), "bbox": [[0, 0, 9, 9]], "bbox_score": 0.9, **more}


def landmarks(scale=1.0, **more):
    """MediaPipe's 33 points as objects."""
    pixels = of_layout(mediapipe.NAMES) * [scale, scale, 1]
    return [{"x": x / SIZE[0], "y": y / SIZE[1], "z": 0.1, **more} for x, y, _ in pixels]


def body_25(points=None):
    return (of_layout(layouts.BODY_25) if points is None else points).ravel().tolist()


@pytest.fixture
def read(tmp_path):
    def of(content, **options):
        path = tmp_path / "some.json"
        path.write_text(json.dumps(content))
        return keypoints.read(path, **options)

    return of


def at(found, name, row=0):
    return found.points[row, found.names.index(name)]


def seen(found, name, row=0):
    return found.confidence[row, found.names.index(name)]


def said(found):
    """The notes without the file's name."""
    return [note.split("some.json: ", 1)[1] for note in found.notes]


MMPOSE = {
    "a list of people": [instance()],
    "one image": {"instances": [instance()]},
    "a video": [{"frame_id": 0, "instances": [instance()]}],
    "a demo": {"meta_info": {}, "instance_info": [{"frame_id": 1, "instances": [instance()]}]},
    "a demo of an image": {"meta_info": {"keypoint_id2name": {"0": "nose"}}, "instance_info": [instance()]},
    "the inferencer": {"predictions": [[instance()]], "visualization": []},
    "lists of lists": [[instance()]],
    "with an axis of length 1": [instance(keypoints=[COCO.tolist()], keypoint_scores=[SCORES.tolist()])],
}


@pytest.mark.parametrize("content", MMPOSE.values(), ids=MMPOSE.keys())
def test_mmpose(read, content):
    found = read(content)
    assert found.names == layouts.COCO_17
    np.testing.assert_array_equal(found.points[0], COCO)
    np.testing.assert_array_equal(found.confidence[0], SCORES)
    assert found.notes == ()


def test_frames_of_a_video_and_those_without_anybody(read):
    frames = [{"frame_id": n, "instances": [] if n == 2 else [instance(1 + n / 10)]} for n in range(4)]
    found = read({"instance_info": frames})
    np.testing.assert_allclose(found.points, COCO * np.array([1, 1.1, 1.3])[:, None, None])
    assert [source.rsplit(": ", 1)[1] for source in found.sources] == ["frame 0", "frame 1", "frame 3"]
    assert said(found) == ["1 of 4 images left out; first of all: frame 2: expected a person, got none"]


def test_a_person_is_followed_over_time(read):
    """The second track is smaller, and the first of the list in one frame."""
    frames = [[instance(track_id=4), instance(0.5, track_id=7)] for _ in range(3)]
    frames[1].reverse()
    content = [{"frame_id": n, "instances": people} for n, people in enumerate(frames)]
    found = read(content)
    np.testing.assert_array_equal(found.points, [COCO] * 3)
    assert said(found) == ["2 people followed over time; took number 4, in 3 of 3 images"]
    np.testing.assert_array_equal(read(content, person=7).points, [COCO / 2] * 3)
    with pytest.raises(ValueError, match="person: expected one of the tracks 4, 7 of .*some.json, got 0"):
        read(content, person=0)


@pytest.mark.parametrize(
    ("factor", "note"),
    [(6.3, ["scores up to 6.3, not 1: divided by that"]), (1.3, ["scores up to 1.3 cut off at 1"])],
)
def test_scores_beyond_1(read, factor, note):
    found = read([instance(keypoint_scores=(SCORES * factor).tolist())])
    expected = SCORES if factor > 2 else (SCORES * factor).clip(0, 1)
    np.testing.assert_allclose(found.confidence[0], expected, atol=1e-12)
    assert said(found) == note


def test_scores_of_a_file_have_one_scale(read):
    low, high = instance(keypoint_scores=[2.5] * 17), instance(keypoint_scores=[5.0] * 17)
    found = read([{"frame_id": 0, "instances": [low]}, {"frame_id": 1, "instances": [high]}])
    np.testing.assert_array_equal(found.confidence[:, 0], [0.5, 1.0])


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (layouts.HALPE_26, {"head_top": 17, "mid_shoulder": 18, "mid_hip": 19, "right_big_toe": 21, "right_heel": 25}),
        (layouts.HALPE_136, {"left_heel": 24, "left_thumb1": 95, "right_pinky_tip": 135}),
        (layouts.COCO_WHOLEBODY_133, {"left_big_toe": 17, "right_heel": 22, "left_thumb1": 92, "right_pinky_tip": 132}),
    ],
)
def test_layouts_of_alphapose_and_mmpose(read, names, expected):
    points = of_layout(names)
    for content in (
        [{"image_id": "1.jpg", "category_id": 1, "keypoints": points.ravel().tolist(), "score": 3.1, "box": [0] * 4}],
        [{"instances": [{"keypoints": points[:, :2].tolist(), "keypoint_scores": points[:, 2].tolist()}]}],
    ):
        found = read(content)
        for name, row in expected.items():
            np.testing.assert_array_equal(at(found, name), points[row, :2])
        np.testing.assert_array_equal(at(found, "left_knee"), WHERE["left_knee"])
        assert said(found) == (["not used: 68 points of the face"] if len(names) > 100 else [])


def test_alphapose_with_names_of_images_and_tracks(read):
    flat = np.column_stack([COCO, SCORES * 4])
    people = [
        {"image_id": f"{n}.jpg", "keypoints": (flat * [s, s, 1]).ravel().tolist(), "score": 2.0, "idx": [track]}
        for n in range(2)
        for s, track in ((0.5, 1), (1.0, 2))
    ]
    found = read(people)
    np.testing.assert_array_equal(found.points, [COCO, COCO])
    assert [source.rsplit(": ", 1)[1] for source in found.sources] == ["0.jpg", "1.jpg"]


@pytest.mark.parametrize(
    "content",
    [
        {"1.jpg": {"version": "v0.3", "people": [{"pose_keypoints_2d": body_25(of_layout(layouts.OPENPOSE_18))}]}},
        {"1.jpg": {"version": "v0.3", "bodies": [{"joints": body_25(of_layout(layouts.OPENPOSE_18))}]}},
        [{"people": [{"pose_keypoints_2d": body_25()}], "canvas_width": 640, "canvas_height": 480}],
        {"people": [{"pose_keypoints": body_25(), "person_id": [-1], "face_keypoints": []}]},
        {"people": [{"pose_keypoints_2d": of_layout(layouts.BODY_25).tolist()}]},
    ],
)  # fmt: skip
def test_openpose_and_its_like(read, content):
    found = read(content)
    for name, place in WHERE.items():
        np.testing.assert_array_equal(at(found, name), place)
    assert found.notes == ()
    if isinstance(content, list):
        np.testing.assert_array_equal(found.image_size, [SIZE])


def test_openpose_mpi(read):
    found = read({"people": [{"pose_keypoints_2d": body_25(of_layout(layouts.MPI_15))}]})
    np.testing.assert_array_equal(at(found, "left_ankle"), WHERE["left_ankle"])
    np.testing.assert_array_equal(at(found, "head_top"), [100, 200])


def test_what_openpose_has_and_nobody_reads(read):
    person = {"pose_keypoints_2d": body_25(), "face_keypoints_2d": [1.0] * 210, "pose_keypoints_3d": [1.0] * 100}
    assert said(read({"people": [{**person, "hand_left_keypoints_3d": []}]})) == [
        "not used: face_keypoints_2d, pose_keypoints_3d"
    ]


@pytest.mark.parametrize("scale", [3, 4])
def test_openpose_relative_to_the_image(read, scale):
    points = of_layout(layouts.BODY_25)
    points[:, :2] /= SIZE
    points[4] = 0.0  # not found
    if scale == 4:
        points[:, :2] = 2 * points[:, :2] - 1
    content = {"people": [{"pose_keypoints_2d": body_25(points)}]}
    with pytest.raises(ValueError, match=r"some.json: image_size: points of .* look relative to the image and need it"):
        read(content)
    found = read(content, image_size=SIZE)
    for name in ("nose", "left_ankle", "right_hip"):
        np.testing.assert_allclose(at(found, name), WHERE[name], atol=1e-9)
    assert seen(found, "right_wrist") == 0
    (note,) = said(found)
    assert "look relative to the image: taken as " + ("0 to 1" if scale == 3 else "-1 to 1") in note


def test_a_person_in_the_lower_right_of_minus_1_to_1(read):
    """All that was found is above 0; what was not found is at -1, -1."""
    points = of_layout(layouts.BODY_25)
    points[:, :2] = 0.2 + points[:, :2] / 1000
    points[4] = [-1, -1, 0]
    found = read({"people": [{"pose_keypoints_2d": body_25(points)}]}, image_size=SIZE)
    np.testing.assert_allclose(at(found, "nose"), (np.array([0.52, 0.29]) + 1) / 2 * SIZE)


def test_relative_points_of_other_trackers(read):
    found = read([instance(keypoints=(COCO / SIZE).tolist())], image_size=SIZE)
    np.testing.assert_allclose(found.points[0], COCO)
    assert "look relative to the image" in said(found)[0]


BAD = {
    "empty": [],
    "too few": body_25()[:60],
    "no numbers": ["x"] * 75,
    "infinite": [float("inf")] * 75,
    "null": None,
}


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("bad", BAD.values(), ids=BAD.keys())
def test_one_of_two_people_cannot_be_used(read, bad, first):
    people = [{"pose_keypoints_2d": bad}, {"pose_keypoints_2d": body_25()}]
    content = {"people": people if first else people[::-1]}
    found = read(content)
    np.testing.assert_array_equal(at(found, "left_knee"), WHERE["left_knee"])
    number = 1 if first else 0
    assert f": 2 people; took number {number}, the largest" in found.notes[0]
    assert f"; cannot be used: {1 - number} (people[{1 - number}]: pose_keypoints_2d: " in found.notes[0]
    with pytest.raises(ValueError, match=rf"some.json: people\[{1 - number}\]: pose_keypoints_2d: .*expected"):
        read(content, person=1 - number)


NAMED = {name.upper(): point for name, point in zip(mediapipe.LANDMARK_NAMES, landmarks(visibility=0.9), strict=True)}
MEDIAPIPE = {
    "MessageToDict": {"landmark": landmarks(visibility=0.9)},
    "poseLandmarks": {"poseLandmarks": landmarks(visibility=0.9)},
    "MessageToDict inside": {"pose_landmarks": {"landmark": landmarks(visibility=0.9)}},
    "tasks": {"pose_landmarks": [landmarks(visibility=0.9, presence=0.99)], "segmentation_masks": None},
    "tasks of JavaScript": {"landmarks": [landmarks(visibility=0.9)], "worldLandmarks": [landmarks(visibility=0.9)]},
    "by names": {"landmarks": NAMED},
    "frames": {"frames": [{"frame_index": 0, "landmarks": landmarks(visibility=0.9)}]},
    "frames by name": {"frame_0": {"landmarks": landmarks(visibility=0.9)}, "frame_1": {}},
    "frames, one empty": [{"pose_landmarks": landmarks(visibility=0.9)}, {"pose_landmarks": None}, None],
    "a bare list": landmarks(visibility=0.9),
    "a list of people": [landmarks(visibility=0.9)],
    "TensorFlow.js": [{"keypoints": [{**p, "score": 0.9} for p in landmarks()], "keypoints3D": []}],
}  # fmt: skip


@pytest.mark.parametrize("content", MEDIAPIPE.values(), ids=MEDIAPIPE.keys())
def test_mediapipe(read, content):
    found = read(content, image_size=SIZE)
    for name, place in WHERE.items():
        np.testing.assert_allclose(at(found, name), place, atol=1e-9)
        assert seen(found, name) == 0.9
    assert (found.points_3d is not None) == ("worldLandmarks" in content)


def test_mediapipe_with_two_people(read):
    small, large = landmarks(0.5, visibility=0.9), landmarks(visibility=0.9)
    for content in ({"landmarks": [small, large]}, {"pose_landmarks": [{"landmark": small}, {"landmark": large}]}):
        found = read(content, image_size=SIZE)
        np.testing.assert_allclose(at(found, "left_knee"), WHERE["left_knee"])
        assert said(found) == ["2 people; took number 1, the largest and most confident"]
        np.testing.assert_allclose(at(read(content, image_size=SIZE, person=0), "left_knee"), WHERE["left_knee"] / 2)


def test_mediapipe_without_visibility(read):
    found = read({"landmark": landmarks()}, image_size=SIZE)
    assert (found.confidence == 1).all()
    assert said(found) == ["no visibility: all points taken as seen"]


def test_what_mediapipe_has_and_nobody_reads(read):
    content = {"pose_landmarks": landmarks(visibility=1.0), "left_hand_landmarks": landmarks()[:21]}
    assert said(read(content, image_size=SIZE)) == ["not used: left_hand_landmarks"]


def test_world_landmarks_alone_are_no_keypoints(read):
    with pytest.raises(ValueError, match="some.json: pose_world_landmarks: expected landmarks in the image, too"):
        read({"pose_world_landmarks": landmarks()})


def test_yolo(read):
    points = {"x": COCO[:, 0].tolist(), "y": COCO[:, 1].tolist(), "visible": SCORES.tolist()}
    points["x"][3], points["y"][3] = 0.0, 0.0
    found = read([{"name": "person", "class": 0, "box": {"x1": 1}, "keypoints": points}])
    np.testing.assert_array_equal(at(found, "right_ankle"), WHERE["right_ankle"])
    assert seen(found, "left_ear") == 0
    assert said(found) == ["points at 0, 0 taken as not seen"]


def test_points_at_minus_one_were_not_seen(read):
    points = COCO.copy()
    points[7] = -1
    found = read([instance(keypoints=points.tolist())])
    assert seen(found, "left_elbow") == 0
    assert said(found) == ["points at -1, -1 taken as not seen"]


def test_points_without_numbers_were_not_seen(read):
    gap = [[None, None] if n == 7 else point for n, point in enumerate(COCO.tolist())]
    found = read([instance(keypoints=gap)])
    assert seen(found, "left_elbow") == 0
    assert seen(found, "left_knee") == SCORES[13]
    assert said(found) == ["1 points without numbers taken as not seen"]


def test_an_image_of_another_size_than_the_file_says(read):
    flat = np.column_stack([COCO, SCORES]).ravel().tolist()
    content = {"images": [{"id": 1, "width": 640, "height": 480}], "annotations": [{"image_id": 1, "keypoints": flat}]}
    assert said(read(content, image_size=SIZE)) == []
    found = read(content, image_size=(1280, 960))
    assert said(found) == ["the file says that its image has 640 × 480 pixels; 1280 × 960 were given"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ([instance(keypoints=COCO[:16].tolist())], r"expected 17 \(COCO\), 26 \(Halpe\), .* points .*, got 16 of 2"),
        ([instance(keypoints=np.ones((17, 3)).tolist())], "got x, y and z: these are 3D points"),
        ({"meta_info": {"keypoint_id2name": {"0": "root", "1": "right_hip"}}, "instance_info": [instance()]},
         r"meta_info: expected .* points from the nose on, got root, right_hip"),
        ({"categories": [{"keypoints": ["pelvis", "neck"]}], "annotations": [instance()]},
         r"categories: expected .* points from the nose on, got pelvis, neck"),
        ([instance(image_id=[1])], r"annotations\[0\]: image_id: expected a number or a name"),
        ([instance(keypoints={"x": [1], "y": [1, 2]})], "expected as many x as y, got 1 and 2"),
        ([instance(keypoint_scores=[50.0] * 17)], "expected confidences of 0 to 1, got 50 to 50"),
        ({"instances": 3}, "instances: expected a list, got int"),
        ({"landmarks": landmarks(visibility=1)[:21]}, "landmarks: expected 33 points, got 21"),
        ({"landmarks": {"NOSE": {"x": 1, "y": 1}}}, "got none of the name left_eye_inner"),
        ({"images": [{"id": 1, "width": [2], "height": "x"}], "annotations": [instance(image_id=1)]},
         "image_size: expected numbers"),
        ({"people": [{"pose_keypoints_2d": body_25()}], "canvas_width": 0, "canvas_height": 4}, "above 0, got 0 and 4"),
    ],
)  # fmt: skip
def test_what_is_refused(read, content, message):
    with pytest.raises(ValueError, match=f"some.json: .*{message}|some.json: {message}"):
        read(content)


@pytest.mark.parametrize("coding", ["utf-8-sig", "utf-16"])
def test_as_windows_writes_text(tmp_path, coding):
    (tmp_path / "some.json").write_text(json.dumps([instance()]), encoding=coding)
    np.testing.assert_array_equal(keypoints.read(tmp_path / "some.json").points[0], COCO)


def test_a_number_of_too_many_digits(tmp_path):
    (tmp_path / "some.json").write_text('{"keypoints": [' + "9" * 10_000 + "]}")
    with pytest.raises(ValueError, match="some.json: is no JSON: a number of 10000 digits"):
        keypoints.read(tmp_path / "some.json")


def test_formats_name_their_points_once():
    for names in (layouts.HALPE_26, layouts.HALPE_136, layouts.OPENPOSE_18, layouts.MPI_15, openpose.NAMES):
        named = [name for name in names if name]
        assert len(named) == len(set(named))
        assert {name.replace("left", "right") for name in named} <= set(named)


DEEP: list = []
for _ in range(200):
    DEEP = [DEEP]
ODD = [DEEP, None, True, -1, 0, 10**400, 1e308, float("nan"), "", "x", [], {}, [[]], {"x": 1}, [[[1]]], [None]]


def damaged(content, rng):
    """The content with one to three values replaced, removed or moved."""
    content = json.loads(json.dumps(content))
    for _ in range(rng.randint(1, 3)):
        nodes, todo = [], [content]
        while todo:
            node = todo.pop()
            if isinstance(node, (dict, list)) and node:
                nodes.append(node)
                todo += node.values() if isinstance(node, dict) else node
        node = rng.choice(nodes[: rng.choice([1, 3, 10, len(nodes)])]) if nodes else content
        keys = list(node) if isinstance(node, dict) else list(range(len(node)))
        if not keys:
            return 3
        key = rng.choice(keys)
        if rng.random() < 0.3:
            del node[key]
        else:
            odd = rng.choice([*ODD, node[key], [node[key]], {"keypoints": node[key]}])
            node[key] = json.loads(json.dumps(odd))
    return content


@pytest.mark.slow
def test_damaged_files_end_in_one_line(tmp_path):
    """2,000 damaged files of all dialects: read, or refused with the file's name, and nothing else."""
    rng = random.Random(5)
    whole = {"keypoints": [0.5] * 51, "foot_kpts": [0.5] * 18, "lefthand_kpts": [0.5] * 63, "image_id": 1}
    annotated = {"images": [{"id": 1, "file_name": "a", "width": 9, "height": 9}], "annotations": [whole]}
    people = {"people": [{"pose_keypoints_2d": body_25(), "person_id": [1]}] * 2}
    seeds = [*MMPOSE.values(), *MEDIAPIPE.values(), annotated, people, {"a.jpg": people}]
    path = tmp_path / "some.json"
    errors = []
    for _ in range(2000):
        path.write_text(json.dumps(damaged(rng.choice(seeds), rng)))
        try:
            found = keypoints.read(path, image_size=SIZE, person=rng.choice([None, None, 0]))
        except ValueError as error:
            errors.append(str(error))
        else:
            assert np.isfinite(found.points).all()
    assert [error for error in errors if "some.json" not in error] == []
    assert 400 < len(errors) < 1800
