"""Gymnasium: every wrapper over every id, single environments and native rows."""

import json
import warnings

from rigid_envs.tasks.registry import ENVIRONMENTS
from tests.clients.wrapping import ROWS, SINGLE, fits, play, wrapped, wrapped_rows

warnings.simplefilter("ignore")  # RecordVideo says that its folder is there already
figures = {"wrappers": len(SINGLE), "of rows": len(ROWS), "played": 0}
for table, make in ((SINGLE, wrapped), (ROWS, wrapped_rows)):
    for name in table:
        for env_id in ENVIRONMENTS:
            if fits(name, env_id):
                env = make(name, env_id)
                play(env, 2)
                env.close()
                figures["played"] += 1
print(json.dumps(figures))
