"""What holds for all tests."""

from hypothesis import settings

# How long an example takes is the machine's matter; timings are measured by pytest-benchmark.
settings.register_profile("no_deadline", deadline=None)
settings.load_profile("no_deadline")
