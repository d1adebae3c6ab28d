"""The ball that rolls on a plane, kinematic and nonholonomic."""
