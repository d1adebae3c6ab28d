"""The spheroid that slides, spins and rolls on a plane: tippe top, egg, loaded ball."""
