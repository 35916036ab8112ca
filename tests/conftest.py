"""Settings of all tests."""

from hypothesis import settings

# the first example of a test may compile a function, which takes seconds on a busy machine
settings.register_profile("discsim", deadline=None)
settings.load_profile("discsim")
