"""Every recording of the shared data is read: how much is in it, and a figure of it that its makers or physics give."""

from __future__ import annotations

import numpy as np
import pytest

from ipman_rs.data import force_plates, markers, opensim

G = 9.80665
MARKERS = {  # file: frames, markers, Hz
    "squat_forceplates/static1.trc": (517, 55, 100),
    "squat_forceplates/squats1.trc": (1346, 51, 100),
    "gait2354/subject01_static.trc": (300, 49, 60),
    "gait2354/subject01_walk1.trc": (151, 41, 60),
    "c3d/walking2.c3d": (1249, 44, 250),
    "motion/drop_jump/DJ1.trc": (269, 51, 100),
    "motion/moco_walking/markers_walk.trc": (238, 41, 100),
    "motion/walking_forces/walkingTS1.trc": (143, 51, 100),
    "motion/child_gait/HC036A01.c3d": (56, 120, 100),
    "motion/child_gait/HC036A10.c3d": (178, 59, 100),
    "motion/c3d_plates/btk_Gait.c3d": (487, 27, 100),
    "motion/c3d_plates/btk_type-2a.c3d": (360, 21, 60),
    "motion/c3d_plates/btk_type-4a.c3d": (360, 21, 60),
    "motion/c3d_plates/btk_type1.C3D": (296, 28, 100),
}
TABLES = {  # file: rows, columns behind the time
    "squat_forceplates/static1_grf.mot": (517, 27),
    "squat_forceplates/squats1_grf.mot": (1346, 27),
    "gait2354/subject01_walk1_grf.mot": (1501, 18),
    "gait2354/g2354_bodykin.sto": (29, 81),
    "c3d/std_cop_walking2_grfs.sto": (101, 18),
    "motion/drop_jump/DJ1_grf.mot": (269, 27),
    "motion/moco_walking/grf_walk.mot": (4778, 18),
    "motion/moco_walking/id_walk.sto": (1350, 31),
    "motion/walking_forces/walkingTS1_grf.mot": (143, 18),
    "motion/results/bmclab_PDS13OF1grf.txt": (6000, 20),
}


def test_no_recording_is_forgotten(shared):
    root = shared("motion").parent
    there = {str(path.relative_to(root)) for path in root.rglob("*") if path.suffix.lower() in (".trc", ".c3d")}
    assert there == set(MARKERS)
    there = {str(path.relative_to(root)) for path in root.rglob("*") if path.suffix.lower() in (".mot", ".sto")}
    assert there == {name for name in TABLES if not name.endswith(".txt")}


@pytest.mark.parametrize("name", MARKERS)
def test_markers(shared, name):
    folder, _, file = name.partition("/")
    found = markers.read(shared(folder) / file)
    frames, count, rate = MARKERS[name]
    assert found.points.shape == (frames, count, 3)
    assert found.rate == pytest.approx(rate, rel=1e-4)
    seen = found.points[found.confidence > 0]
    assert 0.8 < np.ptp(seen[:, 1]) < 2.2  # m: a person, who stands or walks, or jumps from a box
    assert seen[:, 1].min() > -0.05


@pytest.mark.parametrize("name", TABLES)
def test_tables(shared, name):
    folder, _, file = name.partition("/")
    found = opensim.storage(shared(folder) / file)
    assert (len(found), len(found.columns)) == TABLES[name]
    assert found.notes == ()


def test_loads(shared):
    """Peaks and weights that README.md of the data names."""

    def plates(name):
        folder, _, file = name.partition("/")
        return opensim.plates(opensim.storage(shared(folder) / file))

    jump = plates("motion/drop_jump/DJ1_grf.mot")
    assert jump.loads.sum(axis=1).max() == pytest.approx(1977, abs=1)
    flight = (jump.times > 2.175) & (jump.times < 2.555)
    assert not jump.loads[flight].any()
    assert plates("squat_forceplates/static1_grf.mot").loads.sum(axis=1).mean() / G == pytest.approx(60.05, abs=0.01)
    assert plates("motion/moco_walking/grf_walk.mot").forces.shape == (4778, 2, 3)
    child = force_plates.read(shared("motion") / "child_gait" / "HC036A10.c3d")
    assert (child.loads.max(axis=0) > 350).all()  # each foot once, of a child of 35 kg
