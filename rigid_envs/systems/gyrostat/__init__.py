"""The gyrostat: a rigid carrier with up to three wheels along its principal axes."""
