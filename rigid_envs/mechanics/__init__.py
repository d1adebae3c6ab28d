"""What all bodies and systems share."""
