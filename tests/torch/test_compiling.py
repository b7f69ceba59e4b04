"""The marks for torch.compile are torch's own."""

import torch

from ipman_rs.torch.compiling import assume_constant_result


def test_the_mark_is_that_of_torch():
    def own():
        return 1

    def theirs():
        return 1

    assert assume_constant_result(own) is own
    assert vars(own) == vars(torch.compiler.assume_constant_result(theirs)) != {}
