"""Satellite: a rigid body on a circular orbit, turned by gravity and by magnetic coils."""
