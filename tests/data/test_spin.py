"""Data sets in SPIN's form, on miniature files written from the form's description."""

from __future__ import annotations

import numpy as np
import pytest

import ipman_rs.data as data
from tests.helpers.miniatures import human36m, mpi_inf_3dhp, photos, rich_ipman, spin


def pixels_of(frames):
    """Each frame's joints through its camera, in plain loops: X_c = R X + t, then x = K X_c / z."""
    found = np.empty((*frames.joints.shape[:2], 2))
    for f, joints in enumerate(frames.joints):
        for k, point in enumerate(joints):
            rotation, translation = frames.cameras.rotation[f], frames.cameras.translation[f]
            seen = [sum(rotation[i][j] * point[j] for j in range(3)) + translation[i] for i in range(3)]
            intrinsics = frames.cameras.intrinsics[f]
            image = [sum(intrinsics[i][j] * seen[j] for j in range(3)) for i in range(3)]
            found[f, k] = image[0] / image[2], image[1] / image[2]
    return found


def agrees_with_labels(frames):
    """Joints of the world fall on the labelled pixels, and the joints that are not labelled are NaN."""
    names = list(frames.keypoint_names)
    labelled = frames.keypoints[:, [names.index(name) for name in frames.joint_names]]
    known = labelled[..., 2] > 0
    assert (np.isnan(frames.joints).all(-1) == ~known).all()
    np.testing.assert_allclose(pixels_of(frames)[known], labelled[known][:, :2], atol=1e-8)


@pytest.mark.parametrize("packed", [False, True])
def test_human36m(tmp_path, packed):
    file, truth = human36m.write(tmp_path, packed=packed)
    frames = data.open("human36m", file)[:]
    assert frames.names.tolist() == truth["names"]
    assert frames.sequences.tolist() == 6 * ["S9/Directions_1.60457274"] + 6 * ["S9/Directions_2.60457274"]
    assert frames.frame_rate == 10.0  # every fifth image of 50 Hz
    np.testing.assert_array_equal(frames.ground.normal, (0, 0, 1))
    assert frames.ground.height == -0.095
    np.testing.assert_allclose(frames.joints[:, spin.H36M_17], truth["joints"][:, spin.H36M_17], atol=1e-12)
    np.testing.assert_allclose(frames.cameras.translation, truth["t"], atol=1e-12)  # millimetres in the file
    agrees_with_labels(frames)
    assert frames.pose.shape == (12, 24, 3)
    np.testing.assert_allclose(frames.transl, truth["feet"] + (0, 0, 1.2))
    np.testing.assert_array_equal(frames.betas, np.linspace(-1, 1, 120).reshape(12, 10))
    assert frames.genders.tolist() == 12 * ["neutral"]
    assert frames.standing.tolist() == [False, False, True] * 4
    assert frames.contact.tolist() == [False, True, True] * 4
    # The ankles stand 8 cm over the floor of the world.
    np.testing.assert_allclose(frames.ground.signed_height(frames.joints)[:, [0, 5]], 0.08, atol=1e-12)


def test_boxes_hold_the_labels(tmp_path):
    frames = data.open("human36m", human36m.write(tmp_path)[0])[:]
    points = np.where(frames.keypoints[..., 2:] > 0, frames.keypoints[..., :2], np.nan)
    low, high = frames.boxes[:, :2], frames.boxes[:, :2] + frames.boxes[:, 2:]
    assert (np.nanmin(points, axis=1) > low).all()
    assert (np.nanmax(points, axis=1) < high).all()
    np.testing.assert_allclose(frames.boxes[:, 3], 1.2 * (np.nanmax(points, 1) - np.nanmin(points, 1)).max(axis=1))


def test_frames_in_the_camera(tmp_path):
    file, truth = human36m.write(tmp_path)
    frames = data.open("human36m", file, frame="camera")[:]
    assert frames.ground is None
    assert frames.cameras is None
    assert frames.pose is None  # the file has no `pose`
    np.testing.assert_allclose(frames.joints[:, spin.H36M_17], truth["seen"][:, spin.H36M_17], atol=1e-12)
    np.testing.assert_allclose(frames.joints[:, 14], 0, atol=1e-12)  # the pelvis


def test_both_ways_of_writing_images(tmp_path):
    for old in (False, True):
        file, truth = human36m.write(tmp_path, old_names=old)
        assert data.open("human36m", file)[:].names.tolist() == truth["names"]


def test_world_without_smpl(tmp_path):
    """The validation files have joints in the world and no body."""
    frames = data.open("human36m", human36m.write(tmp_path, with_smpl=False)[0])[:]
    assert frames.body is None
    assert frames.pose is None
    assert frames.ground is not None
    agrees_with_labels(frames)


def test_camera_in_metres_is_recognised(tmp_path):
    file, truth = human36m.write(tmp_path, cam_t=None)
    with np.load(file) as arrays:
        spin.save(file, dict(arrays) | {"cam_t": truth["t"][:, :, None]})
    np.testing.assert_allclose(data.open("human36m", file)[:].cameras.translation, truth["t"])


def test_rich_of_ipman(tmp_path):
    file, truth = rich_ipman.write(tmp_path, cameras=(0, 3))
    frames = data.open("rich-ipman", file)[:]
    assert frames.names.tolist() == truth["names"]
    assert frames.sequences[0] == "2021-06-15_Multi_IOI_ID_00186_Yoga1/00"
    np.testing.assert_array_equal(frames.ground.height, np.full(6, 0.3))
    np.testing.assert_allclose(frames.cameras.translation[::2], truth["t"][::2], atol=1e-12)
    assert np.isnan(frames.cameras.translation[1::2]).all()  # of the other cameras the place is lost
    agrees_with_labels(frames[np.array([0, 2, 4])])
    assert frames.standing.all()  # (N, 1) in the file


def test_mpi_inf_3dhp(tmp_path):
    file, truth = mpi_inf_3dhp.write(tmp_path)
    frames = data.open("mpi-inf-3dhp", file)[:]
    assert frames.names.tolist() == truth["names"]
    assert set(frames.sequences) == {"S1/Seq1/imageFrames/video_0"}
    assert frames.frame_rate is None
    assert frames.ground is None
    assert np.isnan(frames.pose[::2]).all()  # has_smpl is 0
    assert np.isnan(frames.betas[::2]).all()
    assert np.isfinite(frames.pose[1::2]).all()
    np.testing.assert_allclose(frames.joints[:, spin.H36M_17], truth["seen"][:, spin.H36M_17], atol=1e-12)


def test_mpi_inf_3dhp_in_the_world(tmp_path):
    file, truth = mpi_inf_3dhp.write(tmp_path, "mpi_inf_3dhp_train_world.npz", world=True)
    frames = data.open("mpi-inf-3dhp", file)[:]
    assert frames.ground is None  # the height of the floor is in no file
    agrees_with_labels(frames)
    ground = data.open("mpi-inf-3dhp", file, height=0.0)[:].ground
    np.testing.assert_allclose(ground.signed_height(frames.joints)[:, 0], 0.08, atol=1e-12)


@pytest.mark.parametrize("eft", [False, True])
@pytest.mark.parametrize("name", photos.KINDS)
def test_photos(tmp_path, name, eft):
    kind = {"c": "coco", "m": "mpii"}.get(name[0], "lsp")
    file, truth = photos.write(tmp_path, name, eft=eft)
    frames = data.open(kind, file)[:]
    assert frames.joints is frames.ground is frames.cameras is None
    assert (frames.pose is not None) == eft
    labelled = frames.keypoints[..., 2] > 0
    assert np.flatnonzero(labelled[:, :24].all(0)).tolist() == sorted(truth["known"])
    assert frames.keypoint_names[24] == "openpose_nose"
    assert len(set(frames.names)) == 6
    if photos.KINDS[name][2] == 2:
        assert frames.names[3:].tolist() == [f"{each}#1" for each in frames.names[:3]]


def test_a_folder_and_its_splits(tmp_path):
    human36m.write(tmp_path, "h36m_valid_protocol1.npz", count=4)
    human36m.write(tmp_path, "h36m_train_world.npz", count=6)
    assert len(data.open("human36m", tmp_path)) == 4  # the first that is there
    assert len(data.open("human36m", tmp_path, split="train")) == 6
    with pytest.raises(ValueError, match=r"none of h36m_valid_protocol2\.npz in it; `ipman data check human36m"):
        data.open("human36m", tmp_path, split="valid-p2")
    with pytest.raises(ValueError, match=r"split: human36m has valid-p2, .*train, got 'test'"):
        data.open("human36m", tmp_path, split="test")


def test_rows_as_slices_and_numbers(tmp_path):
    frames = data.open("human36m", human36m.write(tmp_path)[0])
    every = frames[:]
    for rows in (slice(3, 5), np.array([7, 0, 7]), slice(0, 0)):
        some = frames[rows]
        assert some.names.tolist() == every.names[rows].tolist()
        np.testing.assert_array_equal(some.joints, every.joints[rows])
        np.testing.assert_array_equal(some.cameras.translation, every.cameras.translation[rows])
    assert sum(len(piece) for piece in data.pieces(frames, 5)) == 12


def spoilt(**changes):
    def make(folder):
        file, _ = human36m.write(folder)
        with np.load(file) as arrays:
            given = dict(arrays)
        return spin.save(file, given, {name: change(given[name]) for name, change in changes.items()})

    return make


def halved(folder):
    file, _ = human36m.write(folder)
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    return file


def no_file(folder):
    return folder / "h36m_valid_protocol2.npz"


def other_file(folder):
    file = folder / "h36m_valid_protocol2.npz"
    np.savez(file, poses=np.zeros((3, 156)), trans=np.zeros((3, 3)))
    return file


def turned(values):
    """z up turned into y up: (x, y, z) -> (x, z, -y)."""
    values = values.copy()
    values[..., [0, 1, 2]] = np.stack([values[..., 0], values[..., 2], -values[..., 1]], axis=-1)
    return values


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (no_file, "no such file"),
        (halved, "not a .npz file .*is the download complete"),
        (other_file, r"no imgname, center, scale among its arrays \(poses, trans\)"),
        (spoilt(S=lambda s: s[:-1]), "S: expected 12 rows, as imgname has, got 11"),
        (spoilt(part=lambda p: p[:, :17]), r"part: expected shape \(N, 24, 3\), got \(12, 17, 3\)"),
        (spoilt(pose_world=lambda p: p.astype(str)), "pose_world: expected numbers, got type <U"),
        (spoilt(imgname=lambda i: i.astype(object)), "imgname.*Python objects, which are not loaded"),
        (spoilt(S=lambda s: s.astype(object)), "S.*Python objects, which are not loaded"),
        (spoilt(imgname=lambda i: np.full(i.shape, b"\xff\xfe")), "imgname: holds what is no text"),
        (spoilt(imgname=lambda i: np.full(12 * 4, 0x7FFFFFFF, np.int32).view("U4")), "imgname: holds what is no text"),
        (spoilt(imgname=lambda i: np.arange(12)), "imgname: expected text, got type int64"),
        (spoilt(S_world=lambda s: s * (1000, 1000, 1000, 1)), "joints: looks like millimetres: .*divide by 1000"),
        (spoilt(S_world=lambda s: s * (100, 100, 100, 1)), "joints: looks like centimetres"),
        (spoilt(S_world=turned), r"joints: looks like \+y up: .* up is said to be \(0, 0, 1\)"),
        (spoilt(transl_world=lambda t: t * 1000), "transl: looks like millimetres"),
        (spoilt(pose_world=lambda p: np.degrees(p)), "pose: looks like degrees"),
        (spoilt(S_world=lambda s: s + (0, 0, 1.5, 0)), r"lowest of the joints: 1\.58 m above the ground"),
        (spoilt(cam_r=lambda r: r.swapaxes(1, 2)), "joints (lie behind the camera|seen through the camera lie)"),
        (spoilt(cam_k=lambda k: k / 1000), "cameras.intrinsics: focal lengths .* are no pixels"),
        (spoilt(cam_r=lambda r: r * (1, 1, -1)), "cameras.rotation: .*12 are mirrored"),
        (spoilt(imgname=lambda i: np.repeat(i[:1], 12)), "11 frames share a name, such as 'S9/Directions_1"),
    ],
)  # fmt: skip
def test_bad_files(tmp_path, make, message):
    file = make(tmp_path)
    with pytest.raises(ValueError, match=message) as caught:
        data.open("human36m", file)
    assert str(file) in str(caught.value)


def test_empty_file(tmp_path):
    file, _ = human36m.write(tmp_path)
    with np.load(file) as arrays:
        spin.save(file, {name: values[:0] for name, values in arrays.items()})
    with pytest.raises(ValueError, match="no rows: its arrays are empty"):
        data.open("human36m", file)


def test_rows_that_a_packed_array_claims(tmp_path):
    """A header that promises more rows than the file carries is refused before anything is made of it."""
    file, _ = human36m.write(tmp_path)
    content = file.read_bytes()
    assert content.count(b"'shape': (12, 24, 4)") == 2
    file.write_bytes(content.replace(b"'shape': (12, 24, 4)", b"'shape': (99, 24, 4)"))
    with pytest.raises(ValueError, match=r"array 'S' cannot be read: claims shape \(99, 24, 4\)"):
        data.open("human36m", file)


def test_a_frame_of_nan(tmp_path):
    """It is NaN where the file is, and all other frames are as they were."""
    file, _ = human36m.write(tmp_path)
    whole = data.open("human36m", file)[:]
    with np.load(file) as arrays:
        given = dict(arrays)
    given["S_world"][5], given["pose_world"][5] = np.nan, np.nan
    spin.save(file, given)
    frames = data.open("human36m", file)[:]
    assert np.isnan(frames.joints[5]).all()
    assert np.isnan(frames.pose[5]).all()
    rest = np.delete(np.arange(12), 5)
    np.testing.assert_array_equal(frames.joints[rest], whole.joints[rest])
    found = data.module("human36m").check(file)
    assert any(each.level == "missing" and "S_world: NaN or infinity in 1 of 12 rows" in each.what for each in found)


def test_frame_that_is_not_there(tmp_path):
    file, _ = photos.write(tmp_path, "mpii_train.npz")
    with pytest.raises(ValueError, match=r"frame: 'world' needs S_world or pose_world"):
        data.open("human36m", file, frame="world")


def test_axes_of_the_camera_are_judged(tmp_path):
    """Joints in the camera's axes with y up, as renderers have them."""
    file, _ = mpi_inf_3dhp.write(tmp_path)
    with np.load(file) as arrays:
        given = dict(arrays)
    spin.save(file, given | {"S": given["S"] * (1, -1, -1, 1)})
    with pytest.raises(ValueError, match=r"joints: looks like \+y up"):
        data.open("mpi-inf-3dhp", file)


def test_millimetres_in_the_camera_are_found_by_the_check(tmp_path):
    file, _ = human36m.write(tmp_path)
    with np.load(file) as arrays:
        given = dict(arrays)
    spin.save(file, given | {"S": given["S"] * (1000, 1000, 1000, 1)})
    data.open("human36m", file)  # the world is right
    found = data.module("human36m").check(file)
    assert any("looks like millimetres" in each.what for each in found)
    with pytest.raises(ValueError, match="looks like millimetres"):
        data.open("human36m", file, frame="camera")
