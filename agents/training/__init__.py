"""Training, resumed to the bit; its final evaluation; the benchmark of all environments."""
