"""Config of a training run: entries with rules, YAML, command-line options, shipped recipes."""
