"""Fitting bodies to photos, keypoints and markers, with intuitive physics: IPMAN-O, IPMAN-O* and faster ones."""
