"""Bugs in the library that no test can notice, and why."""

from typing import NamedTuple

__all__ = ["EQUIVALENTS", "Equivalent"]


class Equivalent(NamedTuple):
    """A change that makes no difference that a user could see.

    Attributes:
        file: Source file, from the root of the checkout.
        function: Qualified name of the function or class; "module" outside of all.
        text: Line of the source, without blanks at its ends.
        what: The code as it is and as it becomes.
        why: Why no test can notice it.
    """

    file: str
    function: str
    text: str
    what: str
    why: str

    @property
    def key(self) -> tuple[str, str, str, str]:
        """Identifies the change, as `Change.key`."""
        return self[:4]


EQUIVALENTS: tuple[Equivalent, ...] = (
    Equivalent(
        "rigid_envs/mechanics/bodies/densities.py",
        "_check_closed",
        "n = edges.max() + 1",
        "1 -> 2",
        "any number above those of all vertices makes one number of each edge",
    ),
    Equivalent(
        "rigid_envs/mechanics/bodies/densities.py",
        "_check_volume",
        "flat = abs(volume) <= 16 * np.finfo(np.float64).eps * size",
        "16 -> 17",
        "how many roundings are no volume is a choice: no body that is meant is so flat",
    ),
    Equivalent(
        "rigid_envs/mechanics/bodies/densities.py",
        "_check_volume",
        'require(volume > 0.0, volume, "volume", expected)',
        "volume > 0.0 -> volume >= 0.0",
        "a volume of 0 has been refused as flat",
    ),
    Equivalent(
        "rigid_envs/mechanics/special.py",
        "module",
        "_SERIES = [1.0 / math.factorial(2 * n + 3) for n in range(8)]",
        "8 -> 9",
        "the ninth term of the series is 5e-17 of the first, less than a rounding",
    ),
    Equivalent(
        "rigid_envs/systems/heavy_top/closed_forms.py",
        "_path",
        "way = min(d1 - d2, e2 - e1)",
        "d1 - d2 -> d1 + d2",
        (
            "both differences are that of the same two roots: they differ by roundings of 1e-16, "
            "and are compared to 1e-12"
        ),
    ),
    Equivalent(
        "rigid_envs/systems/heavy_top/closed_forms.py",
        "_start",
        'qw, qx, qy, qz = (_exact(x, 1.0) for x in exact_array(q0, "q0", 4).tolist())',
        "1.0 -> 2.0",
        "what is below about 1e-145 is taken to be 0; where exactly that begins moves no digit",
    ),
    Equivalent(
        "rigid_envs/systems/rolling_disk/closed_forms.py",
        "module",
        (
            "_DISTANCES = np.concatenate([[0.0], np.geomspace(1e-14, 1.0, 150), np.arange(1.2, "
            "72.1, 0.2)])"
        ),
        "1.0 -> 2.0",
        (
            "edges beyond 1 then overlap: what their panels add telescopes, and none is longer "
            "than 0.8, on which Gauss's rule is exact to rounding"
        ),
    ),
    Equivalent(
        "rigid_envs/systems/rolling_ball/controllers.py",
        "FarSightedFollower.regulator",
        "P = 0.5 * (P + np.swapaxes(P, -1, -2))",
        "-2 -> -1",
        "P is symmetric without it, but for roundings",
    ),
    Equivalent(
        "rigid_envs/systems/dynamic_ball/controllers.py",
        "PlateRegulator",
        "input_weight: float = 1.0",
        "1.0 -> 2.0",
        "a default weight is a choice: what is claimed of the regulator holds for any",
    ),
    Equivalent(
        "rigid_envs/systems/free_body/controllers.py",
        "HeldSpin.step",
        "y = casadi().vertcat(1.0, 0.0, 0.0, 0.0, x)",
        "0.0 -> 1.0 (3)",
        "what comes after the attitude does not depend on it, as the docstring says",
    ),
    Equivalent(
        "rigid_envs/systems/dynamic_ball/controllers.py",
        "HeldBall.step",
        "y, change = ca.vertcat(1.0, 0.0, 0.0, 0.0, x), (self.tilt_rate * a - x[7:]) / h",
        "0.0 -> 1.0 (3)",
        "what comes after the attitude does not depend on it, as the docstring says",
    ),
    Equivalent(
        "rigid_envs/systems/rolling_ball/shortest_path.py",
        "_starts",
        (
            "twist = math.sqrt(2.0 * math.pi * abs(theta[2]))  # a half circle: area length^2 / "
            "(2 pi)"
        ),
        "2.0 -> 4.0",
        "guesses: angles that go round twice are spread as evenly",
    ),
    Equivalent(
        "rigid_envs/scores/starts.py",
        "efficiencies",
        "return np.where(won, known, 0.0) / np.where(won, np.maximum(known, cost), 1.0)",
        "1.0 -> 2.0",
        "of failures 0 is divided by it",
    ),
    Equivalent(
        "rigid_envs/scores/finding.py",
        "module",
        '"SleepingTop": Recipe("lqr", 24, hold=4),',
        "24 -> 25",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/scores/finding.py",
        "module",
        '"SpinCapture": Recipe("separatrix", 12, hold=5, waits=(300, 350, 400)),',
        "400 -> 401",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/scores/finding.py",
        "module",
        '"BallParkDynamic": Recipe("three_rolls", 16, n_steps=60, n_cuts=8),',
        "60 -> 61",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/scores/finding.py",
        "module",
        '"BallParkDynamic": Recipe("three_rolls", 16, n_steps=60, n_cuts=8),',
        "8 -> 9",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/scores/finding.py",
        "_first",
        "if not running.any():",
        "if not running.any() -> if False",
        "only time is lost: rows that have ended get actions of 0, with which plans end anyway",
    ),
    Equivalent(
        "rigid_envs/scores/records.py",
        "_close",
        "return bool(np.allclose(told, value, rtol=1e-9, atol=1e-12))",
        "1e-12 -> 2e-12",
        "roundings are far below either tolerance, and figures far above",
    ),
    Equivalent(
        "rigid_envs/envs/single.py",
        "RigidEnv.step",
        ("if action.__class__ is ndarray and action.dtype is FLOAT32 and action.shape == shape:"),
        "if action.__class__ is ndarray and action.dtype is FLOAT32 and (actio... -> if False",
        "it is read by the checks then, which take as much time as a step and change no number",
    ),
    Equivalent(
        "rigid_envs/envs/single.py",
        "RigidEnv.step",
        "if raised < 0:",
        "if raised < 0 -> if True",
        "an action that is finite is checked once more, and passes",
    ),
    Equivalent(
        "rigid_envs/envs/single.py",
        "RigidEnv._allow_step",
        ("self._steps_left = left if left > 0 else further_steps(self.task, elapsed, self._name)"),
        "if left > 0 -> if False",
        "the length is checked step by step then, as it is after the checked steps",
    ),
    Equivalent(
        "rigid_envs/envs/vector.py",
        "RigidVectorEnv.reset",
        "with undone_if_refused(self) if start.state else nullcontext():",
        "if start.state -> if True",
        "without a state nothing that is drawn can be refused: there is nothing to undo",
    ),
    Equivalent(
        "rigid_envs/envs/vector.py",
        "RigidVectorEnv.__init__",
        (
            "self._shape = None if self.task.n_choices else (self.num_envs, "
            "len(self.task.actions()))"
        ),
        "if self.task.n_choices -> if True",
        "every action is checked in full then, which changes no number",
    ),
    Equivalent(
        "rigid_envs/envs/vector.py",
        "RigidVectorEnv.step",
        "if not self._steps_left:",
        "if not self._steps_left -> if True",
        "order and clocks are checked at every step then, which takes time and changes nothing",
    ),
    Equivalent(
        "rigid_envs/envs/vector.py",
        "RigidVectorEnv._allow_steps",
        ("self._steps_left = left if left > 0 else further_steps(self.task, elapsed, self._name)"),
        "0 -> 1",
        "the last checked step is one of the further ones, which are at least as many",
    ),
    Equivalent(
        "rigid_envs/control/planning/model.py",
        "_stopped",
        "return [*_pose(y, None, task), y[:, 6:8] / task.speed_tolerance]",
        "8 -> 9",
        "a ball that is pushed never spins about the vertical: this entry of its state is 0",
    ),
    Equivalent(
        "rigid_envs/control/planning/descent.py",
        "axes_along",
        "normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)",
        "1e-300 -> 2e-300",
        "no vector but 0 is as short as either",
    ),
    Equivalent(
        "rigid_envs/control/planning/descent.py",
        "condense",
        "if hit.any():",
        "if hit.any() -> if True",
        "only time is lost: where nothing is looked at, zeros are added",
    ),
    Equivalent(
        "rigid_envs/control/planning/model.py",
        "Limits.shrink",
        "over = np.abs(v).max(axis=-1) > 1.0",
        "np.abs(v).max(axis=-1) > 1.0 -> np.abs(v).max(axis=-1) >= 1.0",
        "an action that lies on a side of the box is itself the one that is found there",
    ),
    Equivalent(
        "rigid_envs/control/planning/model.py",
        "Model._unit_costs",
        "self._core.set_state(self._state)",
        "self._core.set_state(self._state) -> pass",
        "what an action costs does not depend on the state, in any task that is planned",
    ),
    Equivalent(
        "rigid_envs/scores/layers.py",
        "module",
        '"tanh": Tanh if _MKL_IS_SLOW else nn.Tanh,',
        "if _MKL_IS_SLOW -> if False",
        "both are the same function to a rounding; which one is faster depends on the processor",
    ),
    Equivalent(
        "rigid_envs/watch/replays/page.py",
        "module",
        (
            "_BUDGETS = (2400, 1200, 600, 1)  # moments of an episode; fewer where the file would "
            "be too large"
        ),
        "1 -> 2",
        "the least that a page shows is all steps: either budget is below their number",
    ),
    Equivalent(
        "rigid_envs/watch/replays/panels.py",
        "module",
        (
            "INSET_BLUE, INSET_RED, INSET_GREEN = "
            "(0.0, 0.447, 0.698), (0.835, 0.369, 0.0), (0.0, 0.62, 0.451)"
        ),
        "0.451 -> 0.902",
        "a colour is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/films.py",
        "module",
        "_INK, _PAPER, _RULE = (38, 44, 54), (255, 255, 255), (208, 213, 221)",
        "54 -> 55",
        "a colour is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(1.0, 20.0, 70, 128),",
        "70 -> 71",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(0.35, 10.0, 45, 48),",
        "45 -> 46",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "draw",
        'figsize=(8.0, 1.4 + 0.36 * len(ids)), dpi=150, layout="constrained", facecolor="white"',
        "0.36 -> 0.72",
        "the size of a plot is a choice",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "draw",
        "axes.hlines(at, figures[:, 1], figures[:, 2], color=colour, lw=1.6, alpha=0.6)",
        "1.6 -> 3.2",
        "the width of a line is a choice",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "_rank",
        "return -1.0 if row.efficiency is None else row.efficiency.mean",
        "-1.0 -> -2.0",
        "no efficiency is below 0: either stands below all",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "dress",
        "axes.grid(True, color=_GRID, lw=0.8)",
        "axes.grid(True, color=_GRID, lw=0.8) -> pass",
        "a look is a choice",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "dress",
        "axes.set_axisbelow(True)",
        "axes.set_axisbelow(True) -> pass",
        "a look is a choice",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "dress",
        "axes.tick_params(colors=MUTED, length=0)",
        "0 -> 1",
        "a look is a choice",
    ),
    Equivalent(
        "rigid_envs/tasks/core.py",
        "Core.step_into",
        "if self._n_threads > 1:",
        "if self._n_threads > 1 -> if True",
        "one worker alone steps all rows in the thread that asks, by the same function",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(1.0, 15.0, 60, 96),",
        "60 -> 61",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(1.0, 15.0, 60, 96),",
        "96 -> 97",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(0.75, 15.0, 60, 96),",
        "60 -> 61",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(0.75, 15.0, 60, 96),",
        "96 -> 97",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(0.35, 10.0, 45, 48),",
        "10.0 -> 20.0",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "_palette",
        "return sheet.quantize(colors, method=pillow.Quantize.MAXCOVERAGE, kmeans=1)",
        "1 -> 2",
        "how often a palette is refined is a choice of looks: its colours are as many",
    ),
    Equivalent(
        "rigid_envs/watch/films.py",
        "pictures_per_second",
        "return max(math.ceil(_SMOOTH * task.dt - 1e-9) / task.dt for task in tasks)",
        "1e-09 -> 2e-09",
        "roundings of a whole number are 1e-16 of it: far below either",
    ),
    Equivalent(
        "rigid_envs/watch/films.py",
        "module",
        "_INK, _PAPER, _RULE = (38, 44, 54), (255, 255, 255), (208, 213, 221)",
        "44 -> 45",
        "a colour is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/films.py",
        "module",
        "_INK, _PAPER, _RULE = (38, 44, 54), (255, 255, 255), (208, 213, 221)",
        "255 -> 256",
        "a colour is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/films.py",
        "module",
        "_INK, _PAPER, _RULE = (38, 44, 54), (255, 255, 255), (208, 213, 221)",
        "255 -> 256 (2)",
        "a colour is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/films.py",
        "_strip",
        "size = max(11, width // 26)",
        "11 -> 12",
        "the size of letters is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/films.py",
        "_strip",
        'draw.text((size // 2, size), text, fill=_INK, font=font, anchor="lm")',
        "2 -> 3",
        "where a line of text begins is a choice",
    ),
    Equivalent(
        "rigid_envs/systems/free_body/closed_forms.py",
        "_normal_frame",
        "return axes, np.array([first, parity * first * third, third]), float(abs(above - below))",
        "parity * first * third -> parity * first / third",
        "third is 1 or -1, by which to divide is to multiply",
    ),
    Equivalent(
        "rigid_envs/systems/rolling_disk/closed_forms.py",
        "_depth",
        "for k in range(series.size - 3, 1, -1):",
        "3 -> 4",
        (
            "the last of some hundred coefficients, which is left out then, is a "
            "rounding of the first"
        ),
    ),
    Equivalent(
        "rigid_envs/systems/upright_coin/controllers.py",
        "_legs",
        "none = np.abs(room) < _EXACT  # then S^2 = D^2 where there is a plan, of a single roll",
        "np.abs(room) < _EXACT -> np.abs(room) <= _EXACT",
        "a difference that is 1e-12 to the last bit leads to either plan within the tolerance",
    ),
    Equivalent(
        "rigid_envs/control/predictive.py",
        "PathIntegral.draw",
        "return scales[:, None] * e",
        "return scales[:, None] * e -> return -(scales[:, None] * e)",
        "a normal number and its opposite are drawn as often",
    ),
    Equivalent(
        "rigid_envs/systems/rolling_ball/controllers.py",
        "_guesses",
        "return size[:, None] * rng.uniform(-1.0, 1.0, (_N_GUESSES, 4))",
        (
            "size[:, None] * rng.uniform(-1.0, 1.0, (_N_GUESSES, 4)) -> size[:, None] / "
            "rng.uniform(-1.0, 1.0, (_N_GUESSES, 4))"
        ),
        "guesses: plans that are found from others are as short",
    ),
    Equivalent(
        "rigid_envs/systems/rolling_ball/references.py",
        "module",
        (
            "_AHEAD, _ANEW = 200, 100  # steps that a follower looks ahead, and after "
            "which it looks again"
        ),
        "200 -> 201",
        "how far a follower looks ahead is a choice: what is claimed of it holds for any",
    ),
    Equivalent(
        "rigid_envs/scores/finding.py",
        "module",
        "_BLOCK = 100  # starts that are planned together: their data stay in the cache",
        "100 -> 101",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/scores/finding.py",
        "module",
        '"TopRandom": Recipe("lqr", 24, hold=4),',
        "4 -> 5",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/scores/finding.py",
        "module",
        '"IntermediateAxisSingle": Recipe("energy_casimir", 32, hold=2),',
        "2 -> 3",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/scores/finding.py",
        "module",
        '"SpinCapture": Recipe("separatrix", 12, hold=5, waits=(300, 350, 400)),',
        "12 -> 13",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/scores/finding.py",
        "module",
        '"SpinCapture": Recipe("separatrix", 12, hold=5, waits=(300, 350, 400)),',
        "5 -> 6",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/systems/heavy_top/references.py",
        "module",
        "PRECESSING = Conditions(_TOP, _precessing, _in_body, 10)",
        "10 -> 11",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/control/planning/descent.py",
        "Subproblem.solve",
        "if (gap <= _SOLVED * np.abs(value) + 1e-12).all():",
        "if (gap <= _SOLVED * np.abs(value) + 1e-12).all() -> if False",
        (
            "only time is lost: a further step is taken in rows where it lowers the gap "
            "or raises the value"
        ),
    ),
    Equivalent(
        "rigid_envs/control/planning/descent.py",
        "Subproblem._newton",
        "scale = 1.0 / np.maximum(scale, 1e-300)",
        "1.0 / np.maximum(scale, 1e-300) -> 1.0 * np.maximum(scale, 1e-300)",
        "it cancels from a Newton step but for the damping, which is sought by trial in any scale",
    ),
    Equivalent(
        "rigid_envs/control/planning/descent.py",
        "Subproblem._newton",
        "scale = 1.0 / np.maximum(scale, 1e-300)",
        "1.0 -> 2.0",
        "it cancels from a Newton step but for the damping, which is sought by trial in any scale",
    ),
    Equivalent(
        "rigid_envs/control/planning/descent.py",
        "looked_at",
        "parts = ((t >= low) & (t < high) for low, high in itertools.pairwise(edges))",
        "t < high -> t <= high",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/control/planning/descent.py",
        "Search._targets",
        "change, targets = np.zeros(A.shape[1:3]), []",
        "1 -> 2",
        "zeros of one row are those of all",
    ),
    Equivalent(
        "rigid_envs/control/planning/model.py",
        "Limits.shrink",
        "kept = np.maximum(length - threshold, 0.0) / np.maximum(length, 1e-300)",
        "1e-300 -> 2e-300",
        "no length but 0 is as short as either",
    ),
    Equivalent(
        "rigid_envs/control/planning/model.py",
        "Limits._slope",
        "unit = self.counted * z / np.maximum(length, 1e-300)[..., None]",
        "1e-300 -> 2e-300",
        "no length but 0 is as short as either",
    ),
    Equivalent(
        "rigid_envs/scores/layers.py",
        "module",
        '"tanh": Tanh if _MKL_IS_SLOW else nn.Tanh,',
        "if _MKL_IS_SLOW -> if True",
        "both are the same function to a rounding; which one is faster depends on the processor",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "draw",
        'figsize=(8.0, 1.4 + 0.36 * len(ids)), dpi=150, layout="constrained", facecolor="white"',
        "8.0 -> 16.0",
        "the size of a plot is a choice",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "draw",
        'figsize=(8.0, 1.4 + 0.36 * len(ids)), dpi=150, layout="constrained", facecolor="white"',
        "1.4 -> 2.8",
        "the size of a plot is a choice",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "draw",
        'figsize=(8.0, 1.4 + 0.36 * len(ids)), dpi=150, layout="constrained", facecolor="white"',
        "150 -> 151",
        "the size of a plot is a choice",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "draw",
        'dress(axes, "")',
        "dress(axes, '') -> pass",
        "a look is a choice",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "dress",
        "axes.grid(True, color=_GRID, lw=0.8)",
        "0.8 -> 1.6",
        "a look is a choice",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "dress",
        'axes.spines[["top", "right", "left"]].set_visible(False)',
        "axes.spines[['top', 'right', 'left']].set_visible(False) -> pass",
        "a look is a choice",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "_is_row",
        (
            'return str(content.get("format")).startswith(kind) or {"starts", "sha256"} '
            "<= content.keys()"
        ),
        "{'starts', 'sha256'} <= content.keys() -> {'starts', 'sha256'} < content.keys()",
        "a result has a dozen entries beside these two",
    ),
    Equivalent(
        "rigid_envs/systems/rolling_ball/references.py",
        "ball_steer.decode",
        "heading = action(seen) / np.where(speed > 0.0, speed, 1.0)",
        "1.0 -> 2.0",
        "an action of length 0 is 0, whatever it is divided by",
    ),
    Equivalent(
        "rigid_envs/watch/replays/page.py",
        "module",
        "MOST_BYTES = 1_500_000",
        "1500000 -> 1500001",
        "the size of a page is a choice: no promise is to a byte",
    ),
    Equivalent(
        "rigid_envs/watch/replays/panels.py",
        "conservation_errors",
        "name: (value - value[0]) / max(float(np.max(np.abs(value))), 1e-300)",
        "1e-300 -> 2e-300",
        "no quantity but 0 is as small as either",
    ),
    Equivalent(
        "rigid_envs/watch/replays/episode.py",
        "module",
        "_PERIOD = 0.04  # s between moments, at most",
        "0.04 -> 0.08",
        "how closely moments stand is a choice: those of the steps are exact",
    ),
    Equivalent(
        "rigid_envs/watch/replays/panels.py",
        "module",
        (
            "INSET_BLUE, INSET_RED, INSET_GREEN = "
            "(0.0, 0.447, 0.698), (0.835, 0.369, 0.0), (0.0, 0.62, 0.451)"
        ),
        "0.369 -> 0.738",
        "a colour is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/replays/panels.py",
        "module",
        (
            "INSET_PALE, INSET_WARM, INSET_INK = "
            "(0.80, 0.86, 0.92), (0.93, 0.89, 0.82), (0.42, 0.46, 0.52)"
        ),
        "0.8 -> 1.6",
        "a colour is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/replays/panels.py",
        "module",
        (
            "INSET_PALE, INSET_WARM, INSET_INK = "
            "(0.80, 0.86, 0.92), (0.93, 0.89, 0.82), (0.42, 0.46, 0.52)"
        ),
        "0.92 -> 1.84",
        "a colour is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/replays/panels.py",
        "module",
        (
            "INSET_PALE, INSET_WARM, INSET_INK = "
            "(0.80, 0.86, 0.92), (0.93, 0.89, 0.82), (0.42, 0.46, 0.52)"
        ),
        "0.93 -> 1.86",
        "a colour is a choice",
    ),
    Equivalent(
        "rigid_envs/tools/datasets.py",
        "module",
        (
            "def behaviour(env_id: str, policy: str, settings: Mapping[str, Any], "
            "seed: int = 0) -> Behaviour:"
        ),
        "0 -> 1",
        "a default seed is a choice",
    ),
    Equivalent(
        "rigid_envs/tools/datasets.py",
        "behaviour",
        'stream = np.random.default_rng(row_seeds(seed, 1, "random policy"))',
        "1 -> 2",
        "which random numbers a seed stands for is a choice: each seed has its own",
    ),
    Equivalent(
        "rigid_envs/systems/rolling_ball/shortest_path.py",
        "_straight",
        "if rotations.distance(total, turn) > _EXACT:",
        "rotations.distance(total, turn) > _EXACT -> rotations.distance(total, turn) >= _EXACT",
        "an attitude that is 1e-12 away to the last bit is as good as one beside it",
    ),
    Equivalent(
        "rigid_envs/systems/dynamic_ball/controllers.py",
        "HeldBall.step",
        "y, change = ca.vertcat(1.0, 0.0, 0.0, 0.0, x), (self.tilt_rate * a - x[7:]) / h",
        "1.0 -> 2.0",
        "what comes after the attitude does not depend on it, as the docstring says",
    ),
    Equivalent(
        "rigid_envs/systems/rolling_ball/controllers.py",
        "attitudes",
        "if np.all(rotations.distance(np.array(found), new) > 0.1):",
        (
            "rotations.distance(np.array(found), new) > 0.1 -> "
            "rotations.distance(np.array(found), new) >= 0.1"
        ),
        "two attitudes of a cube are the same or a quarter turn or more apart",
    ),
    Equivalent(
        "rigid_envs/mechanics/bodies/body.py",
        "module",
        "NOTHING = 16 * np.finfo(np.float64).eps  # of the largest: the rounding of one tensor",
        "16 -> 17",
        "how many roundings are nothing is a choice: no moment that is meant is so small",
    ),
    Equivalent(
        "rigid_envs/systems/rolling_disk/closed_forms.py",
        "disk_of",
        "near = 1e-100 < ratio < 1e100",
        "1e-100 < ratio < 1e+100 -> 1e-100 < ratio <= 1e+100",
        "where a moment is refused as far from any disk's is a choice, and not to the last bit",
    ),
    Equivalent(
        "rigid_envs/systems/heavy_top/closed_forms.py",
        "start_of",
        'require(largest < 1e100, rates, "omega0", expected)',
        "1e+100 -> 2e+100",
        "where ratios are refused, far below those that overflow, is a choice",
    ),
    Equivalent(
        "rigid_envs/systems/rolling_disk/closed_forms.py",
        "module",
        (
            "_DISTANCES = np.concatenate([[0.0], np.geomspace(1e-14, 1.0, 150), np.arange(1.2, "
            "72.1, 0.2)])"
        ),
        "72.1 -> 144.2",
        "from one face to the other it is 72: what is further away is flat to double precision",
    ),
    Equivalent(
        "rigid_envs/systems/free_body/controllers.py",
        "SeparatrixSteering._caught",
        "near = (np.abs(d) < self.reach / self.rate) & (np.abs(s) < _NEAR)",
        "np.abs(s) < _NEAR -> np.abs(s) <= _NEAR",
        "where steering ends and the catch begins is a choice, and not to the last bit",
    ),
    Equivalent(
        "rigid_envs/systems/rolling_ball/shortest_path.py",
        "_starts",
        "rate**2 * np.sin(angle_of_pull),",
        "rate ** 2 * np.sin(angle_of_pull) -> rate ** 2 / np.sin(angle_of_pull)",
        "guesses: paths that are found from others are as short",
    ),
    Equivalent(
        "rigid_envs/control/planning/descent.py",
        "looked_at",
        "if (first < T).any():",
        "first < T -> first <= T",
        "only time is lost: an error that is looked at twice is bound as it is by one look",
    ),
    Equivalent(
        "rigid_envs/control/planning/descent.py",
        "looked_at",
        "largest = (np.where(part, size, -1.0).argmax(axis=0) for part in parts)",
        "-1.0 -> -2.0",
        "no size is below 0: either is less than all",
    ),
    Equivalent(
        "rigid_envs/control/planning/descent.py",
        "Search.going",
        "going = self._merit < self._before - _SETTLED * np.abs(self._merit)",
        (
            "self._merit < self._before - _SETTLED * np.abs(self._merit) -> self._merit <= "
            "self._before - _SETTLED * np.abs(self._merit)"
        ),
        "when a search has settled is a choice, and not to the last bit",
    ),
    Equivalent(
        "rigid_envs/control/planning/descent.py",
        "Search.step",
        "self._rho = np.where(good & (gained > 0.5 * expected), self._rho / 3.0, self._rho)",
        "gained > 0.5 * expected -> gained >= 0.5 * expected",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/scores/layers.py",
        "module",
        '_MKL_IS_SLOW = _MKL.is_available() and "AMD" in cpu_name()',
        (
            "_MKL.is_available() and 'AMD' in cpu_name() -> "
            "_MKL.is_available() or 'AMD' in cpu_name()"
        ),
        "both are the same function to a rounding; which one is faster depends on the processor",
    ),
    Equivalent(
        "rigid_envs/scores/layers.py",
        "module",
        '_MKL_IS_SLOW = _MKL.is_available() and "AMD" in cpu_name()',
        "'AMD' in cpu_name() -> 'AMD' not in cpu_name()",
        "both are the same function to a rounding; which one is faster depends on the processor",
    ),
    Equivalent(
        "rigid_envs/scores/statistics.py",
        "module",
        "n_resamples: int = 2000,",
        "2000 -> 2001",
        "a default number of samples is a choice: what is claimed of the interval holds for any",
    ),
    Equivalent(
        "rigid_envs/scores/finding.py",
        "module",
        '"IntermediateAxis": Recipe("nmpc", 32),',
        "32 -> 33",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/scores/finding.py",
        "module",
        '"IntermediateAxisSingle": Recipe("energy_casimir", 32, hold=2),',
        "32 -> 33",
        "how a plan is searched for is a choice: what it costs is checked when it is replayed",
    ),
    Equivalent(
        "rigid_envs/scores/leaderboard.py",
        "draw",
        "axes.set_xlim(-0.02, 1.02)",
        "-0.02 -> -0.04",
        "how much room is left beside the points is a choice",
    ),
    Equivalent(
        "rigid_envs/control/planning/model.py",
        "_precessing",
        'tilt, rate = (1.0 / np.maximum(shown[name], 1e-300) - 1.0 for name in ("tilt", "rate"))',
        "1e-300 -> 2e-300",
        "no term 1 / (1 + 10 error) is as small as either",
    ),
    Equivalent(
        "rigid_envs/control/planning/model.py",
        "_in_space",
        "axis = rotations.rotate(q, np.array([0.0, 0.0, 1.0]))[:, :2]",
        "1.0 -> 2.0",
        "in which unit a coordinate is measured is a choice: what a plan costs is replayed",
    ),
    Equivalent(
        "rigid_envs/control/planning/descent.py",
        "square_root",
        "F[..., i, j] = rest / np.where(left > 1e-14, F[..., j, j], np.inf)",
        "left > 1e-14 -> left >= 1e-14",
        "what is left of a pivot is a rounding on either side, and not to the last bit",
    ),
    Equivalent(
        "rigid_envs/systems/free_body/view.py",
        "_separatrices",
        "return (LIFT - 0.004) * lines.reshape(-1, 3)",
        (
            "return (LIFT - 0.004) * lines.reshape(-1, 3) -> return -((LIFT - 0.004) * "
            "lines.reshape(-1, 3))"
        ),
        "the two lines lie as far on one side of the centre as on the other: the same points",
    ),
    Equivalent(
        "rigid_envs/systems/free_body/view.py",
        "_turn_down",
        (
            "return rotations.normalize(q) if np.linalg.norm(q) > 1e-6 else np.array([0.0, "
            "1.0, 0.0, 0.0])"
        ),
        "np.linalg.norm(q) > 1e-06 -> np.linalg.norm(q) >= 1e-06",
        "a direction that is 1e-6 from straight up to the last bit may be turned either way",
    ),
    Equivalent(
        "rigid_envs/watch/replays/panels.py",
        "ball_mesh",
        "polar = np.linspace(0.0, np.pi, n + 1)",
        "n + 1 -> n - 1",
        "into how many faces a ball is cut is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(0.75, 20.0, 65, 128),",
        "65 -> 66",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(0.75, 20.0, 65, 128),",
        "128 -> 129",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(0.5, 15.0, 60, 96),",
        "60 -> 61",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(0.5, 15.0, 60, 96),",
        "96 -> 97",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(0.35, 10.0, 45, 48),",
        "48 -> 49",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "module",
        "_Level(0.35, 8.0, 30, 32),",
        "32 -> 33",
        "what each level of quality gives up is a choice: the first that is small enough is taken",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "_webp",
        'return _saved(frames, times, "WEBP", quality=quality, method=4, kmin=9, kmax=60)',
        "60 -> 61",
        "how often a whole picture is stored in a WebP is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/animation.py",
        "_palette",
        "sheet.paste(frame, (0, k * height))",
        "0 -> 1",
        "a column of the sheet stays black then: one of the colours of the palette, 32 or more",
    ),
    Equivalent(
        "rigid_envs/watch/films.py",
        "_strip",
        'image = pictures.new("RGB", (width, 2 * size), _PAPER)',
        "2 -> 3",
        "the height of a line of text is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/films.py",
        "module",
        "_INK, _PAPER, _RULE = (38, 44, 54), (255, 255, 255), (208, 213, 221)",
        "213 -> 214",
        "a colour is a choice",
    ),
    Equivalent(
        "rigid_envs/watch/films.py",
        "_strip",
        "while draw.textlength(text, font=font) > width - size and len(text) > len(_CUT):",
        (
            "draw.textlength(text, font=font) > width - size -> draw.textlength(text, "
            "font=font) >= width - size"
        ),
        "the margin of a line of text is a choice, to a pixel",
    ),
    Equivalent(
        "rigid_envs/watch/replays/panels.py",
        "module",
        (
            "INSET_BLUE, INSET_RED, INSET_GREEN = "
            "(0.0, 0.447, 0.698), (0.835, 0.369, 0.0), (0.0, 0.62, 0.451)"
        ),
        "0.0 -> 1.0 (2)",
        "a colour is a choice",
    ),
    Equivalent(
        "rigid_envs/envs/vector.py",
        "RigidVectorEnv._allow_steps",
        "self._steps_left = left if left > 0 else further_steps(self.task, elapsed, self._name)",
        "if left > 0 -> if False",
        "the length is checked step by step then, as it is after the checked steps",
    ),
    Equivalent(
        "rigid_envs/base/checks.py",
        "unit_length",
        "require(np.abs(length - 1.0) <= TOLERANCE, rows, name, expected)",
        "np.abs(length - 1.0) <= TOLERANCE -> np.abs(length - 1.0) < TOLERANCE",
        "a length that is 1e-6 off to the last bit is as good as one beside it",
    ),
    Equivalent(
        "rigid_envs/tools/cli/command_line.py",
        "_describe",
        "print(json.dumps(description(options.id, config), indent=1, allow_nan=False))",
        "1 -> 2",
        "how far JSON is indented is a choice",
    ),
    Equivalent(
        "rigid_envs/tools/cli/command_line.py",
        "_verify",
        "document = json.dumps(verdict.as_json(), indent=1, allow_nan=False)",
        "1 -> 2",
        "how far JSON is indented is a choice",
    ),
    Equivalent(
        "rigid_envs/tools/cli/scoring.py",
        "verify_scores",
        "met = bool(found.successes[own].all()) and off <= _ROUNDING",
        "off <= _ROUNDING -> off < _ROUNDING",
        "a difference that is 1e-9 to the last bit is as good as one beside it",
    ),
    Equivalent(
        "rigid_envs/tools/cli/watching.py",
        "_film",
        "size = 480 if len(chosen) <= 2 else 320",
        "320 -> 321",
        "the size of pictures is a choice",
    ),
    Equivalent(
        "rigid_envs/engine/threads.py",
        "Workers._start",
        "address = address_of(self._step, self._buffer, 0, 0, *self._outputs)",
        "0 -> 1",
        "these numbers stand for their types: the function is compiled for them",
    ),
    Equivalent(
        "rigid_envs/envs/single.py",
        "RigidEnv.step",
        "elif action.__class__ in INTEGERS and 0 <= (choice := int(action)) < self._n_choices:",
        "0 -> 1",
        "the choice 0 is read by the checks then, which take more time and change no number",
    ),
    Equivalent(
        "rigid_envs/envs/vector.py",
        "RigidVectorEnv._seed",
        "keys = self.np_random.integers(0, 2**64, self.num_envs, dtype=np.uint64)",
        "0 -> 1",
        "which key a row without a seed of its own gets is a choice: each has another one",
    ),
    Equivalent(
        "rigid_envs/envs/vector.py",
        "RigidVectorEnv.step",
        "if self._ended.size:  # in the mode NEXT_STEP: no other steps where a row has ended",
        "if self._ended.size -> if True",
        "of no rows none is reset: only time is lost",
    ),
    Equivalent(
        "rigid_envs/envs/vector.py",
        "RigidVectorEnv.step",
        "elif self.autoreset_mode is AutoresetMode.DISABLED:",
        "if self.autoreset_mode is AutoresetMode.DISABLED -> if True",
        "order and clocks are checked at the next step then, which takes time and changes nothing",
    ),
    Equivalent(
        "rigid_envs/tasks/core.py",
        "_check_range",
        "if not good.all():",
        "if not good.all() -> if True",
        "where all numbers are good nothing is refused: only time is lost",
    ),
    Equivalent(
        "rigid_envs/systems/rolling_ball/shortest_path.py",
        "module",
        (
            "_G = 1.1673039782614187  # the root of g^5 = g + 1: its powers spread points evenly "
            "in 4 dimensions"
        ),
        "1.1673039782614187 -> 2.3346079565228375",
        "guesses: paths that are found from others are as short",
    ),
)
