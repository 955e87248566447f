"""How much work a posterior may take that gives a share of an answer only."""

import pytest

from wirebayes.inference.policy import Policy


@pytest.mark.parametrize(
    ("share", "ess", "block", "most_steps"),
    [(1.0, 4000.0, 32, 4000), (0.5, 2000.0, 16, 2000), (0.2, 1000.0, 8, 800), (0.01, 1000.0, 8, 400)],
)
def test_a_share_of_the_answer_takes_that_share_of_the_work(share, ess, block, most_steps):
    policy = Policy().of_share(share)
    assert (policy.ess, policy.block, policy.most_steps) == (ess, block, most_steps)
    assert (policy.walkers, policy.r_hat) == (Policy().walkers, Policy().r_hat)
