"""The thrown body: a rigid body that turns freely while its centre of mass flies."""
