"""Environments made, used and dropped for a long time: nothing may grow."""
