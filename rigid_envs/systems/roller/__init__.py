"""Rollers on inclines and in valleys."""
