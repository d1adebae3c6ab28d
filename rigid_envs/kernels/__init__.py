"""The compiled layer: all functions that run per row.

Every function here is written on scalars and tuples of scalars with ``+ - * / sqrt`` and fused
multiply-add only. No call to the C mathematics library and no ``fastmath``: the same input gives
the same bits on any x86-64 processor, at any number of rows and threads. Rows are `NamedTuple`s
and are read by name.

=================  =================================================================
`compiler`         the decorators by which functions are compiled
`cache`            storage of compiled code on disk, and its key
`numba_version`    the versions of numba that they are tested with
`rows`             memory layout of rows, and the integration loop over them
`elementary`       fma, sincos, atan2, cbrt, log
`algebra`          vectors and quaternions as tuples
`turns`            small rotations from polynomials
`randoms`          counter-based random numbers, one stream per row and episode
`composition`      stages of a fourth-order step
`dynamics`         definition of a system: rows, equations of motion, one step, invariants
`free_body` ...    one file per physical system
`batch`            loops behind the NumPy interface of the systems
`layout`           layout of a batch of rows in one array
`actions`          clipping of actions
`attitude`         observed representations of the attitude
`publication`      results, observations and flags in the arrays that are handed out
`channel`          noise and delay of actions and observations
`goals`            comparison of observed goals
`step_loop`        the step of an environment, over all rows
`reset_loop`       the reset of rows of an environment
`episode`          definition of a task: functions of one row, compiled into step and reset
=================  =================================================================
"""

from rigid_envs.kernels import numba_version

numba_version.check()
