"""Model files in the upstream formats, made here: the real ones may not be shared."""

from __future__ import annotations

import io
import pickle
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse

from tests.helpers import model_arrays


@pytest.fixture(scope="session")
def random_arrays() -> Callable[..., dict[str, np.ndarray]]:
    return model_arrays.random_arrays


@pytest.fixture(scope="session")
def lifelike_arrays() -> Callable[[int], dict[str, np.ndarray]]:
    return model_arrays.lifelike_arrays


class Python2Pickler(pickle._Pickler):  # type: ignore[name-defined]
    """Writes text and bytes as Python 2 did: both are its `str`."""

    dispatch = dict(pickle._Pickler.dispatch)  # type: ignore[attr-defined]

    def save_as_str(self, value: str | bytes) -> None:
        raw = value.encode("latin1") if isinstance(value, str) else value
        self.write(pickle.BINSTRING + len(raw).to_bytes(4, "little") + raw)
        self.memoize(value)

    dispatch[bytes] = dispatch[str] = save_as_str


@pytest.fixture
def chumpy(monkeypatch: pytest.MonkeyPatch) -> types.SimpleNamespace:
    """Stand-ins with the names and the state of chumpy's classes, to write pickles and to read them back plainly."""

    class Ch:
        def __init__(self, **state: Any):
            # what chumpy's __getstate__ leaves: everything but its weak caches
            self.__dict__.update({"_dirty_vars": set(), "_itr": None, "_depends_on_deps": None, **state})

    class Select(Ch):
        pass

    for kind, module in ((Ch, "chumpy.ch"), (Select, "chumpy.reordering")):
        kind.__module__, kind.__qualname__ = module, kind.__name__
        stand_in = types.ModuleType(module)
        setattr(stand_in, kind.__name__, kind)
        monkeypatch.setitem(sys.modules, module, stand_in)
    monkeypatch.setitem(sys.modules, "chumpy", types.ModuleType("chumpy"))
    return types.SimpleNamespace(Ch=Ch, Select=Select)


@pytest.fixture
def write_upstream(tmp_path: Path, chumpy: types.SimpleNamespace) -> Callable[..., Path]:
    """Write arrays as upstream's pickles do: chumpy shapes, a sparse regressor, text beside the arrays."""

    def write(arrays: dict[str, np.ndarray], protocol: int = 2, python2: bool = True) -> Path:
        shapes = arrays["shapedirs"]
        full = np.concatenate([np.zeros_like(shapes), shapes], -1)
        where = np.arange(full.size).reshape(full.shape)[..., shapes.shape[-1] :].ravel()
        content = dict(arrays) | {
            "shapedirs": chumpy.Select(a=chumpy.Ch(x=full), idxs=where, preferred_shape=shapes.shape),
            "posedirs": chumpy.Ch(x=arrays["posedirs"]),
            "J_regressor": scipy.sparse.csc_matrix(arrays["J_regressor"]),
            "J_regressor_prior": scipy.sparse.csr_matrix(arrays["J_regressor"]),
            "bs_style": "lbs",
            "joint2num": np.array({"pelvis": 0}, dtype=object),
            "scale": np.float64(1.0),
        }
        stream = io.BytesIO()
        if python2:
            Python2Pickler(stream, protocol).dump(content)
        else:
            pickle.dump(content, stream, protocol)
        data = stream.getvalue()
        if python2:  # the module names of that time
            for new, old in ((b"numpy._core", b"numpy.core"), (b"scipy.sparse._cs", b"scipy.sparse.cs")):
                data = data.replace(new, old)
        path = tmp_path / f"upstream-{protocol}-{python2}.pkl"
        path.write_bytes(data)
        return path

    return write
