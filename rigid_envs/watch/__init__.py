"""Scene and pixels, films, replays, play, the frame of figures."""
