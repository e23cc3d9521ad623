"""Settings of the whole test suite."""

from hypothesis import settings

# The first call of a kernel compiles it; that is no fault of the property under test.
settings.register_profile("no_deadline", deadline=None, derandomize=True)
settings.load_profile("no_deadline")
