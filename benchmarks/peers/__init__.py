"""What is compared: one file a peer. All loss peers take vertices (B, V, 3) over the ground y = 0 and have

terms(vertices) -> (3, B): stability (or balance), pull, push, each with its own upstream gradient;
weighted(vertices) -> the mean over the bodies of Σ λ · term.
"""
