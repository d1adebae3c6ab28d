"""Vector environments by id, and as Stable-Baselines3 sees them."""
