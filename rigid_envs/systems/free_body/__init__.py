"""The free rigid body: Euler's equations."""
