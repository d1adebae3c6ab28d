"""What the parts of a recipe in the reduced frame are worth: each part alone, and all together."""
