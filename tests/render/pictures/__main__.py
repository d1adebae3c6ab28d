"""Draw the stored pictures anew; look at them before they are committed."""

from PIL import Image

from rigid_envs.tasks.registry import ENVIRONMENTS
from tests.render.pictures.drawing import file_of, picture_of

for env_id in ENVIRONMENTS:
    Image.fromarray(picture_of(env_id)).save(file_of(env_id), optimize=True)
    print(file_of(env_id))
