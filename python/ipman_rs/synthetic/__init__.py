"""Synthetic people: bodies of many shapes, at rest on a floor, and rendered images of them."""
