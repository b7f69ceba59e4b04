"""The former place of `ipman_rs.fitting.detection_problem`."""

from ..renamed import old_module

old_module(__name__, "ipman_rs.fitting.detection_problem")
