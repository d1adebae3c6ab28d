"""Controllers bound to tasks: from the settings of a task to a policy for its rows.

Each module has `REFERENCES`: id -> name of the controller -> builder.
"""
