"""Progress bar on the terminal, and a line for each evaluation."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Mapping
from typing import Any

from tqdm import tqdm  # type: ignore[import-untyped]

__all__ = ["Progress"]

_LOOK = 5.0  # [s] of training, after which the time that is left is told


class Progress:
    """A progress bar with speed, success and return. Off a terminal, only the lines."""

    def __init__(self, quiet: bool) -> None:
        """Show nothing yet.

        Args:
            quiet: Show nothing at all.
        """
        self._quiet = quiet
        self._bar: Any = None
        self._begun: tuple[float, int, int] | None = None  # time, steps made and to make

    def start(self, total: int, done: int) -> None:
        """Show the bar.

        Args:
            total: Steps of the run.
            done: Steps made before.
        """
        self._begun = time.perf_counter(), done, total
        tqdm.set_lock(threading.RLock())  # its own would leave a semaphore behind after a kill
        self._bar = tqdm(
            total=total,
            initial=done,
            unit=" steps",
            unit_scale=True,
            disable=self._quiet or not sys.stderr.isatty(),
            dynamic_ncols=True,
            smoothing=0.05,
        )

    def show(self, timesteps: int, figures: Mapping[str, Any]) -> None:
        """Move the bar, and add a line if there was an evaluation.

        Args:
            timesteps: Steps made.
            figures: Values by name.
        """
        success, total = figures.get("rollout/success_rate"), figures.get("rollout/ep_rew_mean")
        shown = {} if success is None else {"success": f"{100 * success:.1f} %"}
        if total is not None:
            shown["return"] = f"{total:.3g}"
        self._bar.set_postfix(shown, refresh=False)
        self._bar.update(timesteps - self._bar.n)
        self._tell_time(timesteps)
        if "eval/success_rate" in figures:
            self.say(
                f"{timesteps:>12,} steps   held-out starts: success "
                f"{100 * figures['eval/success_rate']:5.1f} %   "
                f"return {figures['eval/mean_reward']:8.3f}   "
                f"length {figures['eval/mean_ep_length']:6.1f}   "
                f"cost {figures['eval/mean_cost']:8.3f}"
            )

    def _tell_time(self, timesteps: int) -> None:
        """Say once how long it will take, at the speed of the first seconds."""
        if self._begun is None:
            return
        since, done, total = self._begun
        if (spent := time.perf_counter() - since) < _LOOK:
            return
        self._begun = None
        speed = (timesteps - done) / spent
        if left := max(0, round((total - timesteps) / speed)):
            self.say(f"{speed:,.0f} steps per second: about {left // 60} min {left % 60} s to go")

    def say(self, line: str) -> None:
        """Print a line above the bar."""
        if not self._quiet:
            tqdm.write(line, file=sys.stderr)

    def close(self) -> None:
        """End the bar."""
        if self._bar is not None:
            self._bar.close()
