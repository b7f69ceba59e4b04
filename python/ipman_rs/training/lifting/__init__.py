"""A regressor from keypoints that trains in seconds, on static people of the embedded body.

bodies    people at rest on the floor        views    cameras around them, keypoints with noise
network   keypoints to features
"""
