"""For how many steps the integrator is known to stay within its stability envelope."""

from rigid_envs.errors import ConfigError
from rigid_envs.tasks import Task

__all__ = ["checked_steps", "further_steps"]


def checked_steps(task: Task, max_episode_steps: int | None) -> int:
    """Steps of an episode for which the rates are known to be within the envelope.

    Args:
        task: The task, which has checked itself with the registered limit.
        max_episode_steps: Time limit in force; None takes the registered one. Gymnasium tells a
            single environment nothing of the limit that it is made with.

    Raises:
        ConfigError: the rates may leave the envelope before the limit.
    """
    if max_episode_steps is None:
        return task.registered_steps()
    task.check_duration(max_episode_steps)
    return max_episode_steps


def further_steps(task: Task, elapsed: int, name: str) -> int:
    """Steps that may follow after so many, at most until the rates may leave the envelope.

    Raises:
        ConfigError: none may; names the remedy.
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
