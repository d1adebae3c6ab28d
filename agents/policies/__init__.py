"""Trained policies in files, which run without Stable-Baselines3."""
