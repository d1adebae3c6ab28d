"""The first example of a property compiles what it calls: no deadline for single examples."""

from hypothesis import settings

settings.register_profile("compiling", deadline=None)
settings.load_profile("compiling")
