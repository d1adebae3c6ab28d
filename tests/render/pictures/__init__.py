"""Stored pictures of every id: `python -m tests.render.pictures` draws them anew."""
