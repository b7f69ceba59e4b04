"""The former place of `ipman_rs.data.plausibility`."""

from ..renamed import old_module

old_module(__name__, "ipman_rs.data.plausibility")
