"""Sums over frames and shards, and what of a difference is chance."""
