"""How much of it a test does, usually and as a campaign."""

import pytest


def sizes(usual: object, campaign: object) -> pytest.MarkDecorator:
    """The test's `size`: what tells a fault from none, and what finds the rare one in minutes."""
    return pytest.mark.parametrize("size", [usual, pytest.param(campaign, marks=pytest.mark.campaign)])
