"""A regressor from keypoints that trains in seconds, on static people of the embedded body.

bodies    people at rest on the floor        views    cameras around them, keypoints with noise, labels that may lean
network   keypoints to features              drill    a training run: the same batches for all that are compared
"""
