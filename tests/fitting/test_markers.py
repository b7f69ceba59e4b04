"""Marker files and the places of markers: real recordings, and a body fitted to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

torch = pytest.importorskip("torch", reason="torch is an extra")

import ipman_rs.torch as ipt  # noqa: E402
from ipman_rs.data import markers  # noqa: E402
from ipman_rs.data.markers.sets import OPENCAP, OPENSIM_GAIT, PLUG_IN_GAIT  # noqa: E402
from ipman_rs.fitting.landmarks import Landmarks, Site  # noqa: E402
from ipman_rs.fitting.marker_calibration import calibrate_sites  # noqa: E402


def trc(rows, units="mm", names=("C7", "L.ASIS")):
    axes = [f"{axis}{index + 1}" for index in range(len(names)) for axis in "XYZ"]
    header = "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits"
    columns = "Frame#\tTime\t" + "\t\t\t".join(names)
    lines = ["PathFileType\t4\t(X/Y/Z)\tx.trc", header, f"60\t60\t{len(rows)}\t{len(names)}\t{units}", columns]
    return "\n".join([*lines, "\t\t" + "\t".join(axes), "", *rows, ""])


def test_trc_of_squats(shared):
    tracks = markers.read(shared("squat_forceplates") / "squats1.trc")
    assert tracks.points.shape == (1346, 51, 3)
    assert tracks.names[:2] == ("C7", "L.ASIS")
    np.testing.assert_array_equal(tracks.points[0, 0], [-0.278799, 1.46173, -0.61037])
    assert tracks.confidence.all()
    assert tracks.times[[0, 1, -1]] == pytest.approx([0, 0.01, 13.45])


def test_trc_in_millimetres(shared):
    tracks = markers.read(shared("gait2354") / "subject01_static.trc")
    assert tracks.points.shape == (300, 49, 3)
    np.testing.assert_allclose(tracks.points[0, 0], [0.60866431, 1.07271313, 0.15744215], rtol=1e-14)
    assert 1.7 < tracks.points[..., 1].max() < 1.9


def test_c3d_with_z_up(shared):
    tracks = markers.read(shared("c3d") / "walking2.c3d")
    assert tracks.points.shape == (1249, 44, 3)
    assert tracks.times[1] - tracks.times[0] == pytest.approx(1 / 250)
    assert tracks.confidence.mean() == pytest.approx(0.49838, abs=1e-5)
    assert np.isfinite(tracks.points).all()
    frame = dict(zip(tracks.names, tracks.points[423], strict=True))
    np.testing.assert_allclose(frame["C7"], [-1.276, 1.495, -0.506], atol=6e-4)  # the file's (x, z, -y)
    assert tracks.confidence[0, tracks.names.index("C7")] == 0
    np.testing.assert_array_equal(tracks.points[0, tracks.names.index("C7")], 0)


def test_missing_samples(tmp_path):
    path = tmp_path / "some.trc"
    path.write_text(trc(["1\t0\t1\t2\t3\t\t\t", "2\t0.5\t0\t0\t0\tNaN\t5\t6\t\t", "3\t1\t10\t20\t30\t40\t50\t60"]))
    tracks = markers.read(path)
    np.testing.assert_array_equal(tracks.confidence, [[1, 0], [0, 0], [1, 1]])
    np.testing.assert_allclose(tracks.points[2], [[0.01, 0.02, 0.03], [0.04, 0.05, 0.06]])
    np.testing.assert_array_equal(tracks.points[1], 0)
    np.testing.assert_allclose(markers.read(path, up="z").points[2, 0], [0.01, 0.03, -0.02])
    np.testing.assert_allclose(markers.read(path, up="x").points[2, 0], [-0.02, 0.01, 0.03])


@pytest.mark.parametrize(("size", "metres"), [(1000.0, 1.0), (1.0, 1.0)])
def test_units_that_are_not_said(tmp_path, size, metres):
    path = tmp_path / "some.trc"
    path.write_text(trc([f"1\t0\t1\t2\t3\t1\t{2 + size}\t3"], units=""))
    first, second = markers.read(path).points[0]
    assert np.linalg.norm(second - first) == pytest.approx(metres)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hello", "line 1: expected PathFileType"),
        ("PathFileType\n", "expected a header of 5 lines, got 1"),
        (trc(["1\t0\t1\t2\tx\t4\t5\t6"]), "line 7: expected numbers: .*'x'"),
        (trc(["1\t0\t1\t2\t3\t4\t5\t6\t7"]), "line 7: expected 8 columns for 2 markers, got 9"),
        (trc(["1\t0\t1\t2\tinf\t4\t5\t6"]), "sample 0, marker 'C7': expected numbers, got infinity"),
        (trc(["1\t0\t\t\t\t\t\t"]), "expected coordinates, all are missing"),
        (trc([]), "expected markers and samples, got 2 and 0"),
        (trc(["1\t0\t1\t2\t3\t4\t5\t6"], units="furlong"), "units: expected one of m, .* got 'furlong'"),
    ],
)
def test_what_is_wrong_in_a_trc(tmp_path, text, message):
    path = tmp_path / "some.trc"
    path.write_text(text)
    with pytest.raises(ValueError, match=f"some.trc: {message}"):
        markers.read(path)


def test_files_that_are_no_markers(tmp_path):
    with pytest.raises(ValueError, match=r"expected a file of markers \(.trc, .c3d\), got .bvh"):
        markers.read(tmp_path / "a.bvh")
    with pytest.raises(ValueError, match="a.trc: there is no such file"):
        markers.read(tmp_path / "a.trc")
    (tmp_path / "b.trc").write_text(trc(["1\t0\t1\t2\t3\t4\t5\t6"]))
    with pytest.raises(ValueError, match="up: expected x, y or z, got 'w'"):
        markers.read(tmp_path / "b.trc", up="w")
    tracks = markers.read(tmp_path / "b.trc")
    assert tracks.select(["L.ASIS"]).points.tolist() == [[[0.004, 0.005, 0.006]]]
    with pytest.raises(ValueError, match="b.trc has no marker 'R.ASIS'; it has C7, L.ASIS"):
        tracks.select(["R.ASIS"])


def test_a_damaged_c3d(tmp_path):
    (tmp_path / "a.c3d").write_bytes(b"no markers in here" * 100)
    with pytest.raises(ValueError, match="a.c3d: expected a C3D file"):
        markers.read(tmp_path / "a.c3d")
    with pytest.raises(ValueError, match="b.c3d: there is no such file"):
        markers.read(tmp_path / "b.c3d")


@pytest.fixture(scope="module", params=["anny", "anny-lite"])
def body(request):
    return ipt.BodyModel(request.param, torch.float64)


@pytest.mark.slow
@pytest.mark.parametrize("named", [OPENCAP, OPENSIM_GAIT, PLUG_IN_GAIT])
def test_markers_are_their_radius_off_the_skin(body, named):
    sites = markers.sites(body.body, named, radius=0.012)
    on_skin = {name: site for name, site in sites.items() if isinstance(site, Site)}
    assert len(on_skin) > 40
    points = Landmarks(body, on_skin, on_skin)(torch.zeros(1, 24, 3, dtype=torch.float64))[0].numpy()
    mesh = trimesh.Trimesh(body.body().vertices, body.body.faces, process=False)
    # The mesh bends within 12 mm (toes, elbows): there another face may be nearer than the one below the marker.
    distance = np.linalg.norm(trimesh.proximity.closest_point_naive(mesh, points)[0] - points, axis=1)
    assert (distance < 0.012 + 1e-9).all()
    assert np.median(distance) > 0.0119
    assert (distance > 0.006).all()


def test_sides_mirror_each_other(body):
    sites = markers.sites(body.body, OPENSIM_GAIT)
    at = Landmarks(body, sites, sites)(torch.zeros(1, 24, 3, dtype=torch.float64))[0].numpy()
    points = dict(zip(sites, at, strict=True))
    for name in ("ASIS", "Acromium", "Knee.Lat", "Knee.Med", "Heel", "Toe.Tip", "Wrist.Med", "Temple"):
        left, right = points[f"L.{name}"], points[f"R.{name}"]
        assert left[0] > 0
        np.testing.assert_allclose(left * [-1, 1, 1], right, atol=0.004)  # the coarse mesh is not quite symmetric
    assert points["L.Knee.Lat"][0] > points["L.Knee.Med"][0] + 0.08
    assert points["L.Wrist.Med"][2] > points["L.Wrist.Lat"][2] + 0.04  # palms down: the radius is in front
    assert points["Top.Head"][1] > 1.68


def test_unknown_markers_are_left_out(body):
    assert list(markers.sites(body.body, ["C7", "Prop.Box", "L_HJC"])) == ["C7", "L_HJC"]


RECORDINGS = {
    ("squat_forceplates", "static1.trc"): 100,
    ("gait2354", "subject01_static.trc"): 50,
    ("c3d", "walking2.c3d"): 430,
}


@pytest.mark.slow
@pytest.mark.parametrize(("folder", "file"), RECORDINGS)
def test_a_body_fits_the_markers(shared, folder, file):
    body = ipt.BodyModel("anny-lite", torch.float64)
    tracks = markers.read(shared(folder) / file)
    sites = markers.sites(body.body, tracks.names)
    assert list(sites) == list(tracks.names)  # all are known
    landmarks = Landmarks(body, sites, sites)
    frame = RECORDINGS[folder, file]
    points, seen = torch.tensor(tracks.points[frame][None]), torch.tensor(tracks.confidence[frame][None, :, None])
    error = closest(landmarks, points, seen)
    assert error < 0.018  # m, without any calibration of where the markers are


def closest(landmarks, points, seen):
    """Mean distance, m, from the markers of the best body found: root, place, then pose and shape."""
    orient = torch.tensor([[0, np.pi / 2, 0]], dtype=torch.float64)  # all of them face +x
    pose = torch.zeros(1, 23, 3, dtype=torch.float64)
    pose[0, 15, 2], pose[0, 16, 2] = -1.2, 1.2  # arms down
    betas, transl = torch.zeros(1, 10, dtype=torch.float64), torch.zeros(1, 3, dtype=torch.float64)

    def errors():
        return (landmarks(torch.cat([orient[:, None], pose], 1), betas, transl) - points) * seen

    with torch.no_grad():
        transl -= errors().sum(1) / seen.sum(1)
    for free, steps in (((orient, transl), 50), ((orient, transl, pose, betas), 200)):
        free = [value.requires_grad_() for value in free]
        optimizer = torch.optim.LBFGS(free, max_iter=steps, line_search_fn="strong_wolfe")

        def loss(optimizer=optimizer):
            optimizer.zero_grad()
            total = errors().square().sum() + 1e-3 * pose.square().sum() + 1e-4 * betas.square().sum()
            total.backward()
            return total

        optimizer.step(loss)
    return (errors().norm(dim=-1).sum() / seen.sum()).item()


def test_calibration_finds_where_the_markers_are(body):
    sites = markers.sites(body.body, ["C7", "L.ASIS", "R.Heel", "LKJC", "L_HJC"])
    rng = np.random.default_rng(2)
    pose = torch.tensor(rng.normal(scale=0.4, size=(6, 24, 3)))
    people = pose, torch.tensor(rng.normal(size=(6, 10))), torch.tensor(rng.normal(size=(6, 3)))
    move = np.array([0.01, -0.02, 0.03])
    true = {
        name: Site(site.vertex, tuple(move + site.shift)) if isinstance(site, Site) else site
        for name, site in sites.items()
    }
    true["L_HJC"] = replace(sites["L_HJC"], place=tuple(move + sites["L_HJC"].place))
    seen = torch.tensor([[1.0, 1, 0, 1, 1]] * 3 + [[0.5, 0, 0, 1, 1]] * 3, dtype=torch.float64)
    observed = Landmarks(body, true, true)(*people) + 9 * (seen == 0)[..., None]
    found = calibrate_sites(body, sites, people, observed, seen)
    for name in ("C7", "L.ASIS"):
        np.testing.assert_allclose(found[name].shift, true[name].shift, atol=1e-12)
    assert found["R.Heel"] == sites["R.Heel"]  # never seen
    assert found["LKJC"] == "left_knee"  # joints of the rig stay
    np.testing.assert_allclose(found["L_HJC"].place, true["L_HJC"].place, atol=1e-12)
    far = calibrate_sites(body, sites, people, observed + 1, torch.ones_like(seen))
    moved = np.subtract(far["R.Heel"].shift, sites["R.Heel"].shift)
    assert np.linalg.norm(moved) == pytest.approx(0.05)
