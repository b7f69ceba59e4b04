"""Maps on a mat, their IoU and the protocol of MoYo, against shapely and against the protocol written out in loops."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
import shapely

import ipman_rs as ip
from ipman_rs.data import PressureMaps
from ipman_rs.evaluation import MoyoFigures, frame_difference, moyo, pressure_iou, pressure_map

HEIGHT, WIDTH, CELL = 7, 9, 0.05
SLOPE = ip.Ground((0.1, -0.2, 1.0), 0.3)


def mat(values, ground=SLOPE):
    """A mat in a corner of this ground, turned by 30 degrees."""
    e1, e2 = ground.axes()
    first, second = math.cos(0.5) * e1 + math.sin(0.5) * e2, math.cos(0.5) * e2 - math.sin(0.5) * e1
    return PressureMaps(np.asarray(values), ground.height * ground.normal + 0.1 * e1, first, second, CELL)


def over(frames, count, ground=SLOPE, seed=0):
    """Samples over, in and beside the mat: (frames, count, 3)."""
    draw, where = np.random.default_rng(seed), mat(np.zeros((1, HEIGHT, WIDTH)), ground)
    i, j = draw.uniform(-2, HEIGHT + 2, (frames, count, 1)), draw.uniform(-2, WIDTH + 2, (frames, count, 1))
    heights = draw.normal(0.02, 0.02, (frames, count, 1))
    return where.origin + CELL * (i * where.e1 + j * where.e2) + heights * ground.normal


def boxes(cells):
    return shapely.union_all([shapely.box(i, j, i + 1, j + 1) for i, j in zip(*cells.nonzero(), strict=True)])


def test_map_by_shapely():
    """Each cell is a square on the mat; shapely says which samples are in it."""
    samples, weights = over(3, 200), np.random.default_rng(1).random((3, 200))
    there = mat(np.zeros((3, HEIGHT, WIDTH)))
    found = pressure_map(samples, weights, there)
    flat = np.stack([(samples - there.origin) @ there.e1, (samples - there.origin) @ there.e2], axis=-1)
    for f, i, j in product(range(3), range(HEIGHT), range(WIDTH)):
        square = shapely.box(i * CELL, j * CELL, (i + 1) * CELL, (j + 1) * CELL)
        inside = shapely.contains(square, shapely.points(flat[f]))
        assert found[f, i, j] == pytest.approx(weights[f][inside].sum(), rel=1e-12)
    assert 0.2 * weights.sum() < found.sum() < 0.8 * weights.sum()


def test_iou_by_shapely():
    """Areas of unions and intersections of the cells above each threshold."""
    draw = np.random.default_rng(2)
    estimated, measured = draw.random((2, 20, HEIGHT, WIDTH)) ** 3
    measured = 50 * measured + 7
    found = pressure_iou(estimated, measured)
    for f in range(20):
        shares = []
        for k in range(10):
            one, other = (
                boxes((each[f] - each[f].min()) / (each[f].max() - each[f].min()) > k / 9)
                for each in (estimated, measured)
            )
            union = one.union(other).area
            shares.append(one.intersection(other).area / union if union else 0)
        assert found[f] == pytest.approx(max(shares), rel=1e-9)
    assert found.min() > 0.3


def test_iou_released_takes_the_measured_map_as_it_is():
    estimated = np.array([[0.0, 0.5, 1.0]])
    raised = np.array([[5.0, 9.0, 5.0]])
    assert pressure_iou(estimated, raised) == 1 / 2  # scaled it is 0, 1, 0
    assert pressure_iou(estimated, raised, "released") == 2 / 3  # all three cells are above every threshold
    measured = np.array([[0.0, 0.4, 0.05]])
    assert frame_difference(estimated, measured) == pytest.approx((0.5 + 0.875) / 3)
    assert frame_difference(estimated, measured, "released") == pytest.approx((0.1 + 0.95) / 3)


def test_iou_where_nothing_is():
    some, nothing = np.eye(3), np.zeros((3, 3))
    assert pressure_iou(nothing, some) == 0
    assert np.isnan(pressure_iou(some, nothing))
    assert np.isnan(frame_difference(some, nothing))
    assert np.isnan(pressure_iou(some, np.full((3, 3), np.nan)))
    assert np.isnan(pressure_iou(np.full((3, 3), np.nan), some))


def written_out(body, ground, there, truth, center, alpha, gamma):
    """IoU, CoP error and frame difference of one body at one α and γ, sample by sample and cell by cell."""
    e1, e2 = ground.axes()
    pressures, cells = [], []
    for point in body:
        height = float(point @ ground.normal - ground.height)
        pressures.append(1 - alpha * height if height < 0 else math.exp(-gamma * height))
        i, j = (
            math.floor((point - there.origin) @ there.e1 / CELL),
            math.floor((point - there.origin) @ there.e2 / CELL),
        )
        cells.append((i, j) if 0 <= i < HEIGHT and 0 <= j < WIDTH else None)
    cop = sum(p * x for p, x in zip(pressures, body, strict=True)) / math.fsum(pressures)
    error = math.hypot((cop - center) @ e1, (cop - center) @ e2)
    on = [p for p, cell in zip(pressures, cells, strict=True) if cell]
    low, high = min(on), max(on)
    image = np.zeros((HEIGHT, WIDTH))
    for p, cell in zip(pressures, cells, strict=True):
        if cell:
            image[cell] += (p - low) / (high - low)
    image = (image - image.min()) / (image.max() - image.min())
    ious = []
    for threshold in np.linspace(0, 1, 10):
        one, other = image > threshold, truth > threshold
        ious.append((one & other).sum() / ((one | other).sum() + 1e-13))
    return max(ious), error, np.abs(image - truth).mean()


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["paper", "released"])
def test_moyo_by_the_protocol_written_out(mode):
    frames = 4
    samples, draw = over(frames, 120), np.random.default_rng(5)
    samples[3] += 0.05 * SLOPE.normal + 0.08 * SLOPE.normal  # hovers
    measured = 3 * draw.random((frames, HEIGHT, WIDTH)) ** 4
    centers = samples.mean(axis=1)
    found = moyo(samples, SLOPE, mat(measured), centers, alpha=60.0, gamma=30.0, pressure_mode=mode)
    assert isinstance(found, MoyoFigures)
    for f in range(frames):
        truth = measured[f]
        if mode == "paper":
            truth = (truth - truth.min()) / (truth.max() - truth.min())
        question = samples[f], SLOPE, mat(measured), truth, centers[f]
        grid = {
            (alpha, gamma): written_out(*question, alpha, gamma)
            for alpha in np.linspace(10, 200, 10)
            for gamma in np.linspace(10, 5000, 15)
        }
        for choice, figure, best in zip(found, range(3), (max, min, min), strict=False):
            iou, error, difference, alpha, gamma = (float(field[f]) for field in choice)
            np.testing.assert_allclose((iou, error, difference), grid[alpha, gamma], rtol=1e-9)
            assert (iou, error, difference)[figure] == pytest.approx(best(row[figure] for row in grid.values()), 1e-9)
        fixed = [float(field[f]) for field in found.fixed]
        np.testing.assert_allclose(fixed[:3], written_out(*question, 60.0, 30.0), rtol=1e-9)
        assert fixed[3:] == [60.0, 30.0]


def test_moyo_of_equal_figures_takes_the_last():
    """As the authors' code does: no sample lies below the ground, so α changes nothing."""
    samples = over(1, 100)
    samples += 0.1 * SLOPE.normal
    measured = np.random.default_rng(0).random((1, HEIGHT, WIDTH))
    assert moyo(samples, SLOPE, mat(measured), samples.mean(axis=1)).best_cop_error.alpha == 200


def test_the_centre_of_pressure_is_the_engines(anny):
    """At fixed parameters, on a real body: the error against the engine's own centre of pressure is 0."""
    vertices = ip.body.posed(anny, "tree")[None]
    samples, floor = ip.sample_surface(vertices, anny.template), ip.Ground.y_up()
    center = ip.center_of_pressure(vertices, anny.template, floor, 70.0, 20.0)
    there = PressureMaps(np.ones((1, 4, 5)) + np.eye(4, 5), *np.eye(3)[[0, 0, 2]], cell=0.1)
    found = moyo(samples, floor, there, center, 70.0, 20.0)
    assert found.fixed.cop_error == pytest.approx(0, abs=1e-6)  # float32
    assert found.best_cop_error.cop_error < 0.05


def test_moyo_where_nothing_is():
    samples, measured = over(5, 80), np.random.default_rng(1).random((5, HEIGHT, WIDTH))
    centers = samples.mean(axis=1)
    samples[0, 3, 0] = np.nan
    measured[1] = 0
    centers[2] = np.nan
    samples[3] += 30.0
    found = moyo(samples, SLOPE, mat(measured), centers)
    for each in found:
        assert np.isnan(each.iou[:2]).all()
        assert np.isnan(each.cop_error[[0, 2]]).all()
        assert each.iou[3] == 0
    assert np.isnan(found.best_iou.iou).tolist() == [True, True, False, False, False]
    assert np.isnan(found.best_cop_error.cop_error).tolist() == [True, False, True, False, False]
    assert np.isfinite(found.fixed.frame_difference[2:]).all()
    whole = moyo(samples[4:], SLOPE, mat(measured[4:]), centers[4:])
    for each, alone in zip(found, whole, strict=True):
        np.testing.assert_array_equal(np.array(each)[:, 4], np.array(alone)[:, 0])


def test_bad_input():
    samples, there = over(2, 10), mat(np.ones((2, HEIGHT, WIDTH)))
    with pytest.raises(ValueError, match=r"pressure: expected one per sample, \(2, 10\), got \(2, 9\)"):
        pressure_map(samples, np.ones((2, 9)), there)
    with pytest.raises(ValueError, match=r"maps: expected two arrays of one shape \(\.\.\., H, W\)"):
        pressure_iou(np.ones((2, 3)), np.ones((3, 2)))
    with pytest.raises(ValueError, match="pressure_mode: expected one of paper, released"):
        pressure_iou(np.ones((2, 3)), np.ones((2, 3)), "raw")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"expected \(F, S, 3\), values \(F, H, W\) and \(F, 3\)"):
        moyo(samples, SLOPE, there, np.zeros((3, 3)))
    with pytest.raises(ValueError, match="gamma: expected a finite number"):
        moyo(samples, SLOPE, there, np.zeros((2, 3)), gamma=np.inf)
    empty = SimpleNamespace(**{**vars(there), "values": np.ones((0, HEIGHT, WIDTH))})
    assert moyo(samples[:0], SLOPE, empty, np.zeros((0, 3))).fixed.iou.shape == (0,)


def test_a_mat_that_was_moved():
    """A row of its place for each frame: as the frames one by one, each over its own mat."""
    samples, values = over(3, 200), np.random.default_rng(4).random((3, HEIGHT, WIDTH))
    still = [mat(values[f : f + 1]) for f in range(3)]
    mats = [replace(there, origin=there.origin + 0.02 * f * there.e1) for f, there in enumerate(still)]
    centers = samples.mean(axis=1)
    moved = PressureMaps(values, *(np.array([getattr(m, part) for m in mats]) for part in ("origin", "e1", "e2")), CELL)
    weights = np.random.default_rng(5).random((3, 200))
    together = moyo(samples, SLOPE, moved, centers)
    for f, alone in enumerate(mats):
        row = slice(f, f + 1)
        assert np.array_equal(
            pressure_map(samples, weights, moved)[row], pressure_map(samples[row], weights[row], alone)
        )
        expected = moyo(samples[row], SLOPE, alone, centers[row])
        for whole, own in zip(together, expected, strict=True):
            assert np.array_equal(np.array(whole)[:, row], np.array(own))
    assert not np.array_equal(np.array(together.fixed), np.array(moyo(samples, SLOPE, mat(values), centers).fixed))
