"""For every test: hypothesis draws the same examples each time, and no clock judges them."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("devcad", deadline=None, derandomize=True)
settings.load_profile("devcad")
