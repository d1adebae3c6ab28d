"""Controllers bound to tasks: functions from a task to a controller of its rows.

The registry names them, id by id.
"""
