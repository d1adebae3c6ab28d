"""The upright coin that rolls on a plane."""
