"""Number of steps for which the integrator stays within its stability envelope."""

from rigid_envs.errors import ConfigError
from rigid_envs.tasks import Task

__all__ = ["checked_steps", "further_steps"]


def checked_steps(task: Task, max_episode_steps: int | None) -> int:
    """Check the stability envelope up to the time limit; returns the limit in steps.

    Args:
        task: The task, which has already checked the registered limit.
        max_episode_steps: Time limit in force; None takes the registered one, as Gymnasium does
            not pass the limit to a single environment.

    Raises:
        ConfigError: the rates may leave the envelope before the limit.
    """
    if max_episode_steps is None:
        return task.registered_steps()
    task.check_duration(max_episode_steps)
    return max_episode_steps


def further_steps(task: Task, elapsed: int, name: str) -> int:
    """Number of further steps before the rates may leave the envelope.

    Raises:
        ConfigError: no further step is allowed; the message names the remedy.
    """
    left = task.stable_steps() - elapsed
    if left > 0:
        return left
    try:
        task.check_duration(elapsed + 1)
    except ConfigError as error:
        raise ConfigError(
            f"{name}: elapsed = {elapsed} steps; expected a reset before: {error}"
        ) from None
    return 1
