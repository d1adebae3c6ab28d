"""Pictures of environments: a view makes a scene (pure data), a backend draws it."""
