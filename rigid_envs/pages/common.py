"""What holds for all environments: said once, in the index of their pages, to which they link."""

__all__ = ["COMMON", "COMMON_TITLE"]

COMMON_TITLE = "What all environments share"

COMMON = """\
A step does this, in this order:

1. The action is rounded to float32 and clipped: each entry to [-1, 1]; in a disk or ball, if its
   squared norm is above 1 + 2^-22, it is divided by its norm and rounded to float32 again.
   `action_clipped` is about this.
2. With `frame="reduced"` it is turned to the frame of the task, by the state before the step.
3. `action_noise`: to every entry a normal number of this standard deviation is added, and the
   action is clipped again.
4. `action_delay`: it acts so many steps later; until the first one does, the action (or choice) 0.
5. The body moves for `dt` under a constant input.
6. Reward terms, cost, success and end follow from the state after the motion and from the input
   that acted, also in the step that ends an episode. A torque impulse is `|tau| dt`, an impulse of
   a step |j|, acceleration times time `|a| dt`.
7. Observed is this state, each entry limited to its Min and Max and rounded to float32.
   `observation_noise`: before that, a normal number is added to every entry except goals.

**Drawn** at every reset are the arguments that are ranges, then a start; numbers are independent
and uniform, the `action_delay` among the integers of its range, both ends included.

**Throughout the last `hold` seconds** means after each of the last n steps, n the least integer
with `n dt >= hold`. The start itself does not count, so success takes at least n steps. With
`hold` = 0 every step is a success, whatever its error.

**Rates that are too fast** end an episode that does not end by itself: the rate that the page
names, times the integrator step, is more than the page accepts. Reward, terms and cost are then 0,
and the state is set to attitude 1 and zeros. A start that is too fast is refused.

**The attitude** is the unit quaternion q = (w, x, y, z), body to world, or its matrix R. `rot6d`
is R11, R21, R31, R12, R22, R32; `quat` is -q where w < 0, else q; `euler` is defined by `R =
Rz(phi) Rx(theta) Rz(psi)`: `theta = 2 atan2(|(x, y)|, |(w, z)|)`, `phi + psi = 2 atan2(z, w)`,
`phi - psi = 2 atan2(y, x)` with `atan2(0, 0) = 0`, phi and psi in [-pi, pi]. It is not shown in
the reduced frame.

**Parameters** of `observe_params` come last, in their units and in the order of *Arguments*, noise
and delay after those of the body; only what is drawn from a range is shown. Formulas of the
reduced frame take the middle of a range in place of what is drawn, except where they say so.

**Beside the state** of the body a task keeps goals and counters:
`env.unwrapped.get_state()["aux"]`, in the order that its page gives; `set_state` takes a changed
copy of what `get_state` gave."""
"""Markdown."""
