"""The compiled layer: everything that runs per row, and nothing else.

Every function here is written on scalars and tuples of scalars with ``+ - * / sqrt`` and fused
multiply-add only. No call to the C mathematics library and no ``fastmath``: the same input gives
the same bits on any x86-64 processor, at any number of rows and threads. Rows are `NamedTuple`s
and are read by name.

=================  =================================================================
`compiler`         the decorators by which functions are compiled
`cache`            where compiled code is kept, and under which key
`rows`             how rows lie in memory, and the integration loop over them
`elementary`       fma, sincos, atan2, cbrt, log
`algebra`          vectors and quaternions as tuples
`turns`            small rotations from polynomials
`randoms`          counter-based random numbers, one stream per row and episode
`composition`      stages of a fourth-order step
`dynamics`         what a system is: its rows, equations of motion, one step, invariants
`free_body` ...    one file per physical system
`batch`            loops behind the NumPy interface of the systems
`layout`           where everything of a batch stands in its one array
`actions`          clipping of actions
`attitude`         the attitude as it is observed
`channel`          noise and delay between the agent and the physics
`goals`            goals as they are observed
`step_loop`        the step and the reset of an environment, over all rows
`episode`          what a task is: its functions of one row, compiled into step and reset
=================  =================================================================
"""
