"""Fits of many inputs, resumable: one item is one file, one failure is its own."""
