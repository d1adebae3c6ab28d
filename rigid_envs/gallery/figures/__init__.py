"""The figures, one module each or one for a family; none imports matplotlib by itself."""
