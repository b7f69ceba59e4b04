"""HMR: an encoder, and a regressor that starts at mean parameters and corrects them in rounds."""

from .backbones import backbone
from .hmr import HMR
from .keypoint_maps import keypoint_maps_loss
from .mean_parameters import MeanParameters
from .regressor import Estimate, Regressor
from .spin_checkpoint import load_spin

__all__ = ["HMR", "Estimate", "MeanParameters", "Regressor", "backbone", "keypoint_maps_loss", "load_spin"]
