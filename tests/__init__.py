"""The tests, one folder for each package. They are packages so that files of one name do not meet, and so that
`tests/torch` and `tests/io` do not stand before the real `torch` and `io`: `tests/` must never be on `sys.path`."""
