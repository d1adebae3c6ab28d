"""Gyrostat: a satellite with reaction wheels."""
