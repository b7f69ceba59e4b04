"""Priors read from files: a mixture of Gaussians against scipy, VPoser against torch's own layers; bad files."""

from __future__ import annotations

import os
import pickle
import zipfile

import numpy as np
import pytest
import torch
from scipy.stats import multivariate_normal

from ipman_rs.fitting.terms.gmm_prior import GaussianMixture
from ipman_rs.fitting.terms.vposer import VPoser
from tests.helpers import fit_terms_cases as cases


@pytest.fixture
def mixture(tmp_path):
    path = tmp_path / "gmm.npz"
    return path, cases.fake_mixture(path)


def cost_of(path, pose: torch.Tensor) -> torch.Tensor:
    problem = cases.problem(len(pose), pose.dtype)
    return GaussianMixture(problem, path).cost(cases.candidate(problem, pose=pose))


def test_mixture_is_the_likeliest_components_negative_log_likelihood(mixture):
    path, arrays = mixture
    pose = cases.variables(6, scale=0.3)["pose"]
    logs = np.stack([
        np.log(weight) + multivariate_normal.logpdf(pose.flatten(1).numpy(), mean, covariance)
        for mean, covariance, weight in zip(arrays["means"], arrays["covars"], arrays["weights"], strict=True)
    ])  # fmt: skip
    peaks = np.log(arrays["weights"]) + [
        multivariate_normal.logpdf(mean, mean, covariance)
        for mean, covariance in zip(arrays["means"], arrays["covars"], strict=True)
    ]
    # scipy inverts by eigenvalues, here it is by Cholesky's factor: 1e-10 of a few hundred
    np.testing.assert_allclose(cost_of(path, pose).numpy(), peaks.max() - logs.max(axis=0), rtol=1e-10)
    assert len(set(logs.argmax(axis=0))) > 1, "all rows choose one component"


def test_mixture_is_zero_at_the_mean_of_its_highest_peak(mixture):
    path, arrays = mixture
    peak = np.argmax(np.log(arrays["weights"]) - 0.5 * np.linalg.slogdet(arrays["covars"])[1])
    pose = torch.from_numpy(arrays["means"][peak]).reshape(1, 23, 3)
    assert cost_of(path, pose).item() == 0


def test_mixture_gradients(mixture):
    path, _ = mixture
    problem = cases.problem(2)
    term = GaussianMixture(problem, path)
    pose = cases.variables(2, scale=0.3)["pose"].requires_grad_()
    assert torch.autograd.gradcheck(lambda pose: term.cost(cases.candidate(problem, pose=pose)), (pose,))


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_mixture_rows_are_alone(mixture, dtype):
    path, _ = mixture
    values = cases.variables(5, dtype)
    cases.assert_rows_are_alone(lambda problem: GaussianMixture(problem, path), cases.problem(5, dtype), values)


def test_mixture_from_a_pickle(mixture, tmp_path):
    path, arrays = mixture
    pickled = tmp_path / "gmm_08.pkl"
    pickled.write_bytes(pickle.dumps(arrays, protocol=2))
    pose = cases.variables()["pose"]
    assert torch.equal(cost_of(pickled, pose), cost_of(path, pose))


def test_a_pickle_that_runs_something_is_refused(tmp_path):
    class Bad:
        def __reduce__(self):
            return os.system, ("echo ran",)

    path = tmp_path / "bad.pkl"
    path.write_bytes(pickle.dumps({"means": Bad()}))
    with pytest.raises(ValueError, match="refused"):
        GaussianMixture(cases.problem(), path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"means": np.zeros((4, 63))}, r"means: expected shape \(4, 69\), got \(4, 63\)"),
        ({"weights": np.array([0.5, 0.5, 0.0, 0.0])}, "weights: expected positive"),
        ({"covars": -np.tile(np.eye(69), (4, 1, 1))}, "covars: expected symmetric positive definite"),
        ({"means": np.full((4, 69), np.nan)}, "means: expected finite"),
    ],
)
def test_bad_mixtures_are_refused(mixture, change, message):
    path, arrays = mixture
    np.savez(path, **{**arrays, **change})
    with pytest.raises(ValueError, match=message):
        GaussianMixture(cases.problem(), path)


def test_a_pickle_of_something_else_is_refused(tmp_path):
    path = tmp_path / "other.pkl"
    path.write_bytes(pickle.dumps({"f": np.zeros(3)}, protocol=2))
    with pytest.raises(ValueError, match="expected means, covars and weights, found f"):
        GaussianMixture(cases.problem(), path)


@pytest.mark.parametrize("prefix", ["vp_model.", ""])
def test_vposer_is_its_layers(tmp_path, prefix):
    path = tmp_path / "vposer.ckpt"
    body, mean = cases.save_vposer(path, prefix)
    problem = cases.problem(4)
    pose = cases.variables(4)["pose"]
    with torch.no_grad():
        expected = mean(body(pose[:, :21].reshape(4, 63)))
    actual = VPoser(problem, path).residuals(cases.candidate(problem, pose=pose))
    torch.testing.assert_close(actual, expected, rtol=1e-12, atol=1e-12)


def test_vposer_with_more_than_tensors_is_refused(tmp_path):
    path = tmp_path / "vposer.ckpt"
    torch.save({"state_dict": {}, "extra": zipfile.ZipInfo("x")}, path)
    with pytest.raises(ValueError, match="cannot be read as a file of tensors"):
        VPoser(cases.problem(), path)


def test_vposer_of_another_layout_is_refused(tmp_path):
    path = tmp_path / "vposer.ckpt"
    torch.save({"state_dict": {"bodyprior_enc_fc1.weight": torch.zeros(512, 63)}}, path)
    with pytest.raises(ValueError, match="expected the encoder of VPoser v2 .* got no encoder_net"):
        VPoser(cases.problem(), path)
    path.write_bytes(b"nothing")
    with pytest.raises(ValueError, match="cannot be read as a file of tensors"):
        VPoser(cases.problem(), path)
