"""Every kind of file gives the numbers of the body that was written into it."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

import ipman_rs as ip
from tests.helpers.cli_files import strict, walk_parameters

# float32 files (.glb, .stl, binary .ply) round 2 m to 1e-7 m; text .obj has 8 digits. The losses are of order 1.
ROUNDED = {"rtol": 1e-4, "atol": 1e-5}


def analyze(run, *arguments):
    result = run("analyze", *arguments, "--json")
    assert result.code == 0, result.err
    return strict(result.out)["bodies"]


def agrees(frame, analysis, **tolerance):
    for key in ("mass", "center_of_mass", "center_of_pressure", "stability", "pull", "push", "balance"):
        np.testing.assert_allclose(frame[key], getattr(analysis, key), err_msg=key, **tolerance)
    np.testing.assert_allclose(frame["margin"], analysis.base_of_support.margin, **tolerance)


@pytest.mark.parametrize("ending", ["obj", "ply", "glb"])
def test_a_mesh_of_the_embedded_body_has_its_parts(run, tmp_path, lite_body, standing, ending):
    path = tmp_path / f"body.{ending}"
    trimesh.Trimesh(standing, lite_body.faces, process=False).export(path)
    (body,) = analyze(run, path)
    assert body["template"]["parts"] == list(lite_body.part_names)
    assert body["center_of_mass_method"] == "pcom"
    assert any("anny-lite" in note for note in body["notes"])
    agrees(body["frames"][0], ip.analyze(standing, lite_body.template, ip.Ground()), **ROUNDED)


def test_stl_corners_are_merged_and_the_body_is_one_part(run, tmp_path, lite_body, standing):
    path = tmp_path / "body.stl"
    trimesh.Trimesh(standing, lite_body.faces, process=False).export(path)
    (body,) = analyze(run, path)
    template = ip.BodyTemplate(standing, lite_body.faces)
    assert body["template"]["watertight"]
    assert body["template"]["vertices"] == len(standing)
    assert body["center_of_mass_method"] == "exact"
    assert any("exact" in note for note in body["notes"])
    frame, solid = body["frames"][0], ip.mass_properties(standing, template)
    np.testing.assert_allclose(frame["mass"], solid.mass, rtol=1e-5)
    np.testing.assert_allclose(frame["center_of_mass"], solid.center, atol=1e-5)


def test_npz_of_vertices_keeps_every_digit(run, tmp_path, lite_body, standing):
    frames = np.stack([standing, standing + [0.1, 0.2, 0.0]])
    np.savez(tmp_path / "two.npz", vertices=frames, faces=lite_body.faces)
    (body,) = analyze(run, tmp_path / "two.npz")
    expected = ip.analyze(frames, lite_body.template, ip.Ground(height=standing[:, 1].min()))
    for t in (0, 1):
        frame = body["frames"][t]
        assert frame["stability"] == expected.stability[t]
        assert frame["center_of_mass"] == expected.center_of_mass[t].tolist()
    assert body["frames"][1]["margin"] is None
    assert body["frames"][1]["status"] == ["NO_CONTACT"]


def test_npz_without_faces_takes_those_of_the_body(run, tmp_path, standing):
    np.savez(tmp_path / "bare.npz", vertices=standing)
    (body,) = analyze(run, tmp_path / "bare.npz", "--body", "anny-lite")
    assert body["center_of_mass_method"] == "pcom"
    result = run("analyze", tmp_path / "bare.npz", "--json")
    assert result.code == 1
    assert "--body" in result.err


def test_texture_seams_do_not_open_a_mesh(run, tmp_path):
    box = trimesh.creation.box((0.4, 0.4, 0.4))
    lines = [f"v {x} {y} {z}" for x, y, z in box.vertices]
    lines += [f"vt {k / 40} 0.5" for k in range(3 * len(box.faces))]
    for f, (a, b, c) in enumerate(box.faces + 1):
        lines.append(f"f {a}/{3 * f + 1} {b}/{3 * f + 2} {c}/{3 * f + 3}")
    (tmp_path / "box.obj").write_text("\n".join(lines) + "\n")
    (body,) = analyze(run, tmp_path / "box.obj")
    assert body["template"]["watertight"]
    np.testing.assert_allclose(body["frames"][0]["volume"], 0.064, rtol=1e-12)


def test_amass_parameters_are_z_up_and_say_what_is_missing(run, tmp_path):
    stored = walk_parameters()
    np.savez(tmp_path / "walk_poses.npz", **stored)
    (body,) = analyze(run, tmp_path / "walk_poses.npz", "--body", "anny-lite")
    notes = " | ".join(body["notes"])
    for word in ("z (assumed", "fingers", "betas belong to SMPL", "lowest vertex of all frames"):
        assert word in notes
    assert body["ground"]["normal"] == [0, 0, 1]
    model = ip.load_body("anny-lite")
    pose = np.zeros((8, 24, 3), np.float32)
    pose[:, :22] = stored["poses"].reshape(8, 52, 3)[:, :22]
    vertices = model(pose, transl=stored["trans"].astype(np.float32)).vertices
    expected = ip.analyze(vertices, model.template, ip.Ground.z_up(float(vertices[..., 2].astype(float).min())))
    assert [frame["seconds"] for frame in body["frames"]] == [t / 20 for t in range(8)]
    np.testing.assert_allclose([f["stability"] for f in body["frames"]], expected.stability, rtol=1e-5)


@pytest.mark.parametrize("form", ["pieces", "whole", "joints"])
def test_body_model_arguments(run, tmp_path, form):
    model = ip.load_body("anny-lite")
    pose = np.zeros((1, 24, 3))
    pose[0, 0, 1], pose[0, 4, 0], pose[0, 18, 1] = 0.4, 0.7, -0.5
    flat, betas, transl = pose.reshape(1, 72), np.full((1, 10), 0.3), np.array([[0.1, 0.0, 0.2]])
    stored = {
        "pieces": {"global_orient": flat[:, :3], "body_pose": flat[:, 3:]},
        "whole": {"pose": flat[0]},
        "joints": {"pose": pose},
    }[form]
    np.savez(tmp_path / "arguments.npz", betas=betas, transl=transl, **stored)
    (body,) = analyze(run, tmp_path / "arguments.npz", "--body", "anny-lite", "--ground", "0")
    vertices = model(pose[0], betas[0], transl[0]).vertices
    expected = ip.analyze(vertices, model.template, ip.Ground())
    assert body["ground"] == {"normal": [0, 1, 0], "height": 0}
    # The file's parameters are posed in float32: 1e-6 m, which a loss of steepness 100 / m shows as 1e-4.
    agrees(body["frames"][0], expected, rtol=1e-3, atol=1e-5)


def test_up_and_ground_options(run, tmp_path, lite_body, standing):
    tilted = standing[:, [0, 2, 1]] * [1, 1, -1]  # y down the z axis: up is -z
    np.savez(tmp_path / "tilted.npz", vertices=tilted, faces=lite_body.faces)
    by_axis, by_normal = (
        analyze(run, tmp_path / "tilted.npz", "--up", up, "--ground", "-0.01")[0]["frames"][0]
        for up in ("-z", "0,0,-3")
    )
    assert by_axis == by_normal
    np.testing.assert_allclose(by_axis["lowest"], 0.01, atol=1e-12)
    for wrong in (("--up", "w"), ("--up", "0,0,0"), ("--ground", "nan"), ("--preset", "none")):
        assert run("analyze", tmp_path / "tilted.npz", "--json", *wrong).code == 2


@pytest.mark.parametrize("ending", ["json of vertices", "json", "npy", "npz"])
def test_parts_files(run, tmp_path, lite_body, standing, ending):
    turned = lite_body.faces[::-1]  # another order of the faces: not the embedded topology any more
    labels = lite_body.face_parts[::-1]
    np.savez(tmp_path / "body.npz", vertices=standing, faces=turned)
    path = tmp_path / f"parts.{ending.split()[0]}"
    if ending == "json of vertices":
        members = {"low": standing[:, 1] < 0.8, "high": standing[:, 1] >= 0.8}
        path.write_text(json.dumps({name: np.flatnonzero(member).tolist() for name, member in members.items()}))
        low = (standing[turned, 1] < 0.8).sum(axis=1) >= 2
        labels, names = np.where(low, 0, 1), ["low", "high"]
    elif ending == "json":
        path.write_text(json.dumps(labels.tolist()))
        names = [f"part {k}" for k in range(10)]
    elif ending == "npy":
        np.save(path, labels)
        names = [f"part {k}" for k in range(10)]
    else:
        np.savez(path, face_parts=labels, part_names=np.array(lite_body.part_names))
        names = list(lite_body.part_names)
    (body,) = analyze(run, tmp_path / "body.npz", "--parts", path)
    expected = ip.part_volumes(standing, ip.BodyTemplate(standing, turned, labels, names))
    assert body["frames"][0]["part_volumes"] == dict(zip(names, expected.tolist(), strict=True))
