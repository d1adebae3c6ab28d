"""Replays and small views of them, for tests of the page."""

from typing import Any

import gymnasium as gym
import numpy as np

from rigid_envs.tasks.core import Moment
from rigid_envs.watch.replays.recording import RecordReplay
from rigid_envs.watch.replays.replay import Replay
from rigid_envs.watch.scene import Arrow, Camera, Floor, Frame, Mesh, Part, Pose, Scene, Trace, View

SIDES = ((0.0, 0.45, 0.7), (0.84, 0.37, 0.0), (0.0, 0.62, 0.45))


def box(a: float, b: float, c: float) -> Mesh:
    """A box of half sides a, b, c, with a colour for each pair of sides."""
    vertices, normals, colors, triangles = [], [], [], []
    for k in range(3):
        for sign in (1.0, -1.0):
            normal = sign * np.eye(3)[k]
            across = np.eye(3)[(k + 1) % 3]
            up = np.cross(normal, across)
            first = len(vertices)
            vertices += [
                normal + x * across + y * up for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
            ]
            normals += 4 * [normal]
            colors += 4 * [np.array(SIDES[k]) * (1.0 if sign > 0 else 0.65)]
            triangles += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return Mesh(
        (np.array(vertices) * (a, b, c)).astype(np.float32),
        np.array(normals, dtype=np.float32),
        np.round(255 * np.array(colors)).astype(np.uint8),
        np.array(triangles, dtype=np.int32),
    )


class BodyView(View):
    """A box that turns, and its angular velocity."""

    def make_scene(self) -> Scene:
        """The scene."""
        parts = {"body": Part(box(1.0, 0.6, 0.25))}
        camera = Camera(distance=6.0)
        return Scene(parts, camera, {"omega": Arrow((0.8, 0.2, 0.0), 0.06, "\u03c9")})

    def frame(self, moment: Moment) -> Frame:
        """The moment."""
        omega = self.task.system(moment.parameters).omega_world(moment.y)
        text = (f"t = {moment.time:.2f} s", f"reward {moment.reward:.3f}")
        return Frame({"body": Pose(q=moment.y[:4])}, {"omega": ((0, 0, 0), omega)}, text=text)


class BallView(View):
    """A box in place of a ball, which rolls on a floor and leaves a path."""

    def make_scene(self) -> Scene:
        """The scene."""
        traces = {"path": Trace((0.0, 0.45, 0.7), 0.06)}
        floor = Floor(0.0, 16.0, 1.0)
        side = 0.58 * self.parameters["radius"]
        camera = Camera((0, 0, 0.5), 11.0, follow="ball")
        return Scene({"ball": Part(box(side, side, side))}, camera, {}, traces, floor)

    def frame(self, moment: Moment) -> Frame:
        """The moment."""
        x, y = moment.y[4:6]
        radius = moment.parameters["radius"]
        pose = Pose((x, y, radius), moment.y[:4])
        return Frame({"ball": pose}, {}, {"path": (x, y, 0.01)}, (f"cost {moment.cost:.2f}",))


def view_of(task: Any, parameters: dict[str, float]) -> View:
    """A view of a free body, or of something that rolls."""
    return (BodyView if "omega_body" in task.system_type.components else BallView)(task, parameters)


def idle(
    env_id: str,
    n_steps: int = 20,
    state: dict[str, Any] | None = None,
    seed: int = 0,
    label: str = "",
    **config: Any,
) -> Replay:
    """An episode in which nothing is done, from a start that is drawn or given."""
    env = RecordReplay(gym.make(env_id, **config), label=label)
    env.reset(seed=seed, options=None if state is None else {"state": state})
    for _ in range(n_steps):
        env.step(np.zeros(env.action_space.shape, dtype=np.float32))
    return env.replay()


def free_body(n_steps: int = 60) -> Replay:
    """A body that nothing acts on, near the unstable axis."""
    return idle("RigidEnvs/IntermediateAxis-v0", n_steps, seed=1, label="free")


def recorded(env_id: str, n_steps: int = 6, n_episodes: int = 1, **config: Any) -> Replay:
    """Some random steps of some episodes."""
    env = RecordReplay(gym.make(env_id, **config), label="random")
    env.action_space.seed(3)
    for k in range(n_episodes):
        env.reset(seed=k)
        for _ in range(n_steps):
            _, _, terminated, truncated, _ = env.step(env.action_space.sample())
            if terminated or truncated:
                break
    replay = env.replay()
    env.close()
    return replay


def rolling_ball(label: str, seed: int, n_steps: int = 40) -> Replay:
    """A ball that is rolled at random."""
    env = RecordReplay(gym.make("RigidEnvs/BallPark-v0"), label=label)
    env.reset(seed=5)
    env.action_space.seed(seed)
    action = env.action_space.sample()
    for k in range(n_steps):
        if k % 10 == 0:
            action = env.action_space.sample()
        env.step(action)
    return env.replay()
