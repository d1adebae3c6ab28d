"""Settings of all property tests."""

from hypothesis import HealthCheck, settings

# The first example compiles what it calls, and a machine may be busy: examples are not timed.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")
