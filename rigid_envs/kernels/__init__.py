"""The compiled layer: everything that runs per row, and nothing else.

Every function here is written on scalars and tuples of scalars with ``+ - * / sqrt`` and fused
multiply-add only. No call to the C mathematics library and no ``fastmath``: the same input gives
the same bits on any x86-64 processor, at any number of rows and threads.

=================  =================================================================
`compiler`         the two decorators, and where compiled code is kept
`rows`             how rows of state lie in memory, and the integration loop over them
`elementary`       fma, sincos, atan2, cbrt, log
`algebra`          vectors and quaternions as tuples
`randoms`          counter-based random numbers, one stream per row and episode
`free_body` ...    one file per physical system: equations of motion, invariants, one step
`layout`           where everything of a batch stands in its one array
`channel`          noise and delay between the agent and the physics
`episode`          the step and the reset of an environment, over all rows
=================  =================================================================
"""
