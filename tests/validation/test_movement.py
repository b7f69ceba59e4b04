"""What made-up people do: their bodies and feet go along paths in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ipman_rs.gravity import GRAVITY
from ipman_rs.validation.movement import Movement, longest_run, smooth

RATE = 100.0
TIMES = np.arange(300) / RATE
HEIGHT = 0.95  # m, of the centre of mass


def person(com, feet, lifted, forward=(0.0, 0.0, 1.0)):
    """`com` (T, 3); `feet` (T, 2), how far the left and the right one are before it; `lifted` above the floor."""
    ways = np.tile(forward, (len(com), 1))
    left = np.cross([0.0, 1.0, 0.0], ways)
    soles = []
    for side, sign in ((0, 1), (1, -1)):
        foot = com + feet[:, side, None] * ways + 0.1 * sign * left
        foot[:, 1] = lifted[:, side]
        soles += [foot + 0.1 * ways, foot - 0.1 * ways]
    acceleration = np.gradient(np.gradient(com, 1 / RATE, axis=0), 1 / RATE, axis=0)
    return Movement(com, acceleration, np.stack(soles, axis=1), np.array([True, True, False, False]), ways, 0.0, RATE)


def still():
    com = np.tile([0.0, HEIGHT, 0.0], (len(TIMES), 1))
    return com, np.zeros((len(TIMES), 2)), np.zeros((len(TIMES), 2))


def stride(speed):
    """A foot on the floor goes back under the body at `speed`, and comes forward lifted, in turns of 0.5 s."""
    phase = TIMES[:, None] + [0.0, 0.5]
    back = phase % 1.0 < 0.5
    along = np.where(back, 0.25 - phase % 1.0, phase % 1.0 - 0.75) * speed
    return along, np.where(back, 0.0, 0.06)


def test_standing_and_squatting():
    com, feet, lifted = still()
    com[:, 0] += 0.003 * np.sin(TIMES)
    assert person(com, feet, lifted).kind == "quiet standing"
    com[:, 1] -= 0.3 * np.sin(2 * np.pi * TIMES / 3) ** 2
    assert person(com, feet, lifted).kind == "movement in place"


@pytest.mark.parametrize("forward", [(0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)])
def test_walking_over_a_floor_and_on_a_treadmill(forward):
    com, _, _ = still()
    feet, lifted = stride(1.2)
    assert person(com, feet, lifted, forward).kind == "walking"
    assert person(com + np.outer(1.2 * TIMES, forward), feet, lifted, forward).kind == "walking"
    assert person(com, feet, 0.06 - lifted, forward).kind == "movement in place"  # feet go back lifted: no treadmill
    assert person(com, 0 * feet, lifted, forward).kind == "movement in place"  # marching
    one = person(com + np.outer(1.2 * TIMES, forward), feet, lifted, forward)
    assert replace(one, acceleration=np.full_like(com, np.nan)).kind == "walking"


def test_running_and_jumping():
    com, feet, lifted = still()
    flight = (TIMES >= 1.0) & (TIMES < 1.4)
    com[flight, 1] += 2.0 * (TIMES[flight] - 1.0) - GRAVITY / 2 * (TIMES[flight] - 1.0) ** 2
    lifted[flight] = (com[flight, 1] - HEIGHT)[:, None] + 0.001
    jump = person(com, feet, lifted)
    assert jump.kind == "jump"
    assert replace(jump, acceleration=np.full_like(com, np.nan)).kind == "jump"
    feet, steps = stride(1.2)
    assert person(
        com + np.outer(3.0 * TIMES, [0, 0, 1]), feet, lifted + np.where(flight[:, None], 0.05, steps)
    ).kind == ("running")


def test_on_a_box_is_no_flight():
    com, feet, lifted = still()
    lifted[:100] = 0.31
    com[:100, 1] += 0.31
    quiet = replace(person(com, feet, lifted), acceleration=np.zeros_like(com))
    assert quiet.kind == "movement in place"
    assert replace(quiet, acceleration=np.full_like(com, np.nan)).kind == "movement in place"


def test_the_longest_run():
    assert longest_run(np.array([0, 1, 1, 0, 1, 1, 1], bool)) == 3
    assert longest_run(np.zeros(4, bool)) == 0


def test_headings_on_average():
    turns = np.pi / 2 * np.arange(100) / 100
    ways = np.stack([np.sin(turns), 0 * turns, np.cos(turns)], axis=1)
    found = smooth(ways, 20)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(found[20:80], ways[20:80], atol=1e-12)  # of an even turn the mean is the middle
    np.testing.assert_array_equal(smooth(ways[:1], 20), ways[:1])
