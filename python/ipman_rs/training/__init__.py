"""IPMAN-R: regressors of bodies from images or keypoints, trained with the intuitive-physics losses.

model     HMR: an encoder and an iterative regressor        batch     inputs and labels of a step
losses    the terms, one per file, and their weighted sum     augment   flip, turn, scale and noise; the camera follows
world     from the camera's frame to the world's            lifting   a regressor from keypoints that trains in seconds
benchmark the ablation of the paper on built bodies         trainer   `ipman train` on Lightning

Needs the extra `train`; `lifting` and `benchmark` need `fit` alone.
"""
