"""What the tests of training share. They need the extra `train`; those of Lightning's are skipped without it."""

from __future__ import annotations

import pytest
import torch

from ipman_rs.synthetic import population
from ipman_rs.training.lifting import views


@pytest.fixture(autouse=True)
def _one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="session")
def static():
    """28 static people, four of each family."""
    return population.draw_population(28, seed=7)


@pytest.fixture(scope="session")
def posing():
    return views.posing()
