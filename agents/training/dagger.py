"""Learning from a law: DAgger, a regression on what a teacher would do where the pupil comes."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import flatdim
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv
from torch import nn
from torch.nn.functional import smooth_l1_loss

from rigid_envs.base.settings import refusal
from rigid_envs.envs.lookup import task_of
from rigid_envs.envs.shells import RigidVectorEnv
from rigid_envs.scores.policies import Controller, Script, reference_controllers

from ..config.entries import DAggerConfig

# The teacher: a reference controller that is a function of the state.


def teacher_of(config: DAggerConfig) -> Controller:
    """The controller that teaches: of the task of the training, in the frame of the world.

    Args:
        config: Config of the run.

    Raises:
        ConfigError: None of its name, or one that follows a plan of its own: what it would do
            depends on more than the state.
    """
    known = reference_controllers(config.env_id)
    name = next(iter(known), "") if config.teacher == "reference" else config.teacher
    if name not in known:
        expected = f"one of {list(known)}" if known else f"no dagger: {config.env_id} has no law"
        raise refusal("teacher", config.teacher, expected)
    law = known[name](task_of(config.env_id, {**config.training_kwargs, "frame": "world"}))
    if isinstance(law, Script):
        raise refusal("teacher", name, "a law of the state: this one follows plans made before")
    return law


# All that was seen and taught.


class Lessons:
    """Observations, and what the teacher would have done; the oldest are replaced.

    Attributes:
        buffer_size: Steps of each row that are kept at most.
        pos: Where the next one goes.
        full: Whether there are so many.
        observations: Shape (buffer_size, n_envs, n).
        actions: Of the teacher, shape (buffer_size, n_envs, m).
    """

    def __init__(self, buffer_size: int, env: VecEnv) -> None:
        """Make room for so many steps of each row."""
        self.buffer_size, self.pos, self.full = buffer_size, 0, False
        sizes = (flatdim(space) for space in (env.observation_space, env.action_space))
        self.observations, self.actions = (
            np.zeros((buffer_size, env.num_envs, size), np.float32) for size in sizes
        )

    def size(self) -> int:
        """Steps of each row that are kept."""
        return self.buffer_size if self.full else self.pos

    def add(self, observations: NDArray[Any], actions: NDArray[Any]) -> None:
        """Keep a step of all rows."""
        self.observations[self.pos], self.actions[self.pos] = observations, actions
        self.pos = (self.pos + 1) % self.buffer_size
        self.full |= self.pos == 0

    def draw(self, n: int) -> tuple[torch.Tensor, torch.Tensor]:
        """Observations and actions of n steps, drawn by torch's generator."""
        which = torch.randint(self.size() * self.actions.shape[1], (n,)).numpy()
        seen, done = (
            part.reshape(-1, part.shape[-1]) for part in (self.observations, self.actions)
        )
        return torch.from_numpy(seen[which]), torch.from_numpy(done[which])


_LEAST_VARIANCE = 1e-6

# A dead band, as two more ReLU units for each entry of an action.


@contextmanager
def with_dead_band(model: Any, band: float) -> Iterator[None]:
    """While in this context, actions z of a model are ``relu(z - band) - relu(-z - band)``.

    They are exactly 0 within the band and nearer to 0 by it elsewhere. It is one more hidden layer,
    so files, exports and compiled networks hold it like any other.

    Args:
        model: SB3 model of a Gaussian policy with ReLU; afterwards it is what it was before.
        band: Half the width; with 0 the model is left as it is.
    """
    policy = model.policy
    hidden, last = policy.mlp_extractor.policy_net, policy.action_net
    if band == 0.0:
        yield
        return
    m = last.out_features
    split: Any = nn.utils.skip_init(nn.Linear, last.in_features, 2 * m)  # type: ignore[no-untyped-call]
    join: Any = nn.utils.skip_init(nn.Linear, 2 * m, m)  # type: ignore[no-untyped-call]
    with torch.no_grad():
        split.weight.copy_(torch.cat([last.weight, -last.weight]))
        split.bias.copy_(torch.cat([last.bias, -last.bias]) - band)
        join.weight.copy_(torch.cat([torch.eye(m), -torch.eye(m)], dim=1))
        join.bias.zero_()
    policy.mlp_extractor.policy_net = nn.Sequential(*hidden, split, nn.ReLU())
    policy.action_net = join
    try:
        yield
    finally:
        policy.mlp_extractor.policy_net, policy.action_net = hidden, last


class DAgger(PPO):
    """A model of PPO whose policy is learnt by regression on the actions of a teacher.

    In the first update the teacher acts, in all others the policy, whose states the teacher is
    asked about: the form without parameters of dataset aggregation. Each update goes on with the
    regression of the mean action on all that was taught so far, by the loss of Huber, so that a few
    surprises do not move what is right elsewhere: with a narrow `loss_width` it is the median that
    is learnt, and an action that is mostly 0 stays 0.

    The network learns ``a + dead_band sign(a)``, and 0 where a is 0; `dead_band` takes it back. So
    small errors of the network cost nothing where the teacher rests. The standard deviation of the
    policy, with which PPO would go on, is that of the last errors.

    Source: Ross, Gordon & Bagnell 2011, *A Reduction of Imitation Learning and Structured
    Prediction to No-Regret Online Learning*, algorithm 3.1, arXiv:1011.0686.
    """

    def __init__(
        self,
        *,
        teacher: Controller,
        buffer_size: int,
        batch_size: int,
        gradient_steps: int,
        dead_band: float,
        loss_width: float,
        **of_ppo: Any,
    ) -> None:
        """Make the networks, and room for the lessons.

        Args:
            teacher: See `teacher_of`.
            buffer_size: Steps that are kept, of all rows together.
            batch_size: Samples per gradient step.
            gradient_steps: Of an update.
            dead_band: See `with_dead_band`.
            loss_width: Error up to which the loss is quadratic.
            **of_ppo: Arguments of PPO.
        """
        super().__init__(batch_size=of_ppo["n_steps"] * of_ppo["env"].num_envs, **of_ppo)
        assert self.env is not None
        self.batch_size = batch_size  # which need not divide the steps of an update, as in PPO
        self.teacher, self.gradient_steps = teacher, gradient_steps
        self.dead_band, self.loss_width = dead_band, loss_width
        self.replay_buffer = Lessons(buffer_size // self.n_envs, self.env)
        for name, weight in self.policy.named_parameters():
            weight.requires_grad_(name.startswith(("mlp_extractor.policy_net", "action_net")))

    def collect(self, rows: RigidVectorEnv) -> None:
        """Make `n_steps` of every row, and keep what the teacher would have done.

        Args:
            rows: The native rows in the environment of the model.
        """
        assert self.env is not None
        taught_first = self._n_updates == 0
        with with_dead_band(self, self.dead_band):
            for _ in range(self.n_steps):
                right = rows.in_frame(np.clip(self.teacher(rows), -1.0, 1.0)).astype(np.float32)
                seen: Any = self._last_obs
                self.replay_buffer.add(seen, right)
                done = right if taught_first else self.predict(seen, deterministic=True)[0]
                after: Any
                after, _, ends, infos = self.env.step(done)
                self._last_obs = after
                self._last_episode_starts = ends
                self.num_timesteps += self.n_envs
                self._update_info_buffer(infos, ends)

    def train(self) -> None:
        """Gradient steps of the regression."""
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.policy.optimizer)
        losses = []
        for _ in range(self.gradient_steps):
            seen, right = self.replay_buffer.draw(self.batch_size)
            mean = self.policy.action_net(self.policy.mlp_extractor.policy_net(seen))
            wanted = right + self.dead_band * right.sign()
            loss = smooth_l1_loss(mean, wanted, beta=self.loss_width)
            self.policy.optimizer.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            self.policy.optimizer.step()
            losses.append(loss.detach())
        with torch.no_grad():
            square = ((mean - wanted) ** 2).mean(dim=0).clamp(min=_LEAST_VARIANCE)
            self.policy.log_std.copy_(0.5 * square.log())
        self._n_updates += self.gradient_steps
        self.policy.set_training_mode(False)
        self.logger.record("train/n_updates", self._n_updates)
        self.logger.record("train/loss", torch.stack(losses).mean().item())
