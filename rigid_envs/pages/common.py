"""What holds for all environments: said once, in the index of their pages, to which they link."""

from rigid_envs.pages.document import Section
from rigid_envs.pages.sections import blocks

__all__ = ["COMMON"]

_STEP = """
1. The action is rounded to float32 and clipped: each entry to [-1, 1]; in a disk or ball, if its
squared norm is above 1 + 2^-22, it is divided by its norm and rounded to float32 again.
`info["action_clipped"]` is about this.

2. With `frame="reduced"` it is turned to the frame of the task, by the state before the step.

3. To every entry a normal number of the standard deviation `action_noise` is added, and the action
is clipped again.

4. It acts `action_delay` steps later; until the first one does, the action (or choice) 0 acts.

5. The body moves for `dt` under a constant input.

6. Reward terms, cost, success and end follow from the state after the motion and from the input
that acted, also in the step that ends an episode. A torque impulse is `|tau| dt`, an impulse of a
step `|j|`, acceleration times time `|a| dt`.

7. Observed is this state, each entry limited to its Min and Max and rounded to float32; before the
rounding, a normal number of the standard deviation `observation_noise` is added to every entry
except goals, and the sum is limited again.
"""
_STARTS = """
Every reset draws the arguments that are ranges, then a start. Numbers are independent and uniform,
`action_delay` among the integers of its range, both ends included. The start has to be slow enough
for the integrator; one that is given and is not is refused.

Beside the state a task keeps goals and counters, in the order that its page gives:
`env.unwrapped.get_state()["aux"]`. `set_state` takes a changed copy of what `get_state` gave.
"""
_ENDS = """
"Throughout the last `hold` seconds" means after each of the last n steps, n the least integer with
`n dt >= hold`. The start does not count, so a success takes at least n steps. With `hold` = 0 every
step is a success, whatever its error.

A motion is too fast for the integrator if the rate that the page names, times the integrator step,
is more than the page accepts, and the episode does not end by itself. Reward, terms and cost are
then 0. The state, and what the task keeps beside it, is set to attitudes 1 and zeros (a heading to
(1, 0), a curvature to 1), which is observed.
"""
_ATTITUDE = """
The state has the unit quaternion q = (w, x, y, z), body to world, its matrix is R. `rot6d` is R11,
R21, R31, R12, R22, R32; `quat` is -q where w < 0, else q; `euler` has `R = Rz(phi) Rx(theta)
Rz(psi)`, from `theta = 2 atan2(|(x, y)|, |(w, z)|)`, `phi + psi = 2 atan2(z, w)` and `phi - psi = 2
atan2(y, x)` with `atan2(0, 0) = 0`, phi and psi in [-pi, pi]. None is shown in the reduced frame.
"""
_PARAMETERS = """
`observe_params` shows what is drawn from a range, in its unit, at the end of the observation and in
the order of Arguments: those of the body, then noise and delay. Formulas of the reduced frame take
the middle of a range in place of what is drawn, except where they say otherwise.
"""

COMMON = Section(
    "What all environments share",
    [],
    [
        Section("A step, in this order", blocks(_STEP)),
        Section("Starts", blocks(_STARTS)),
        Section("Successes and ends", blocks(_ENDS)),
        Section("Attitudes", blocks(_ATTITUDE)),
        Section("Parameters", blocks(_PARAMETERS)),
    ],
)
"""Section of the index."""
