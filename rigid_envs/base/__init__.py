"""What everything else may use: checks, settings, files, provenance."""
