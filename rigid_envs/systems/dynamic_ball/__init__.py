"""The ball with inertia, rolling on a plate that tilts, turns and shakes."""
