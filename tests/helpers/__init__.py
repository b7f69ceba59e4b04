"""What tests of several folders share: bodies, files, and outside judges. Imported as `tests.helpers`."""
