"""How good a policy can be: reference controllers by environment id."""
