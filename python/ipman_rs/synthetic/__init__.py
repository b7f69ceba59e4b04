"""People that are made, not measured: bodies of many shapes, at rest on a floor, and rendered images of them."""
