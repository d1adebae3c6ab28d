"""Train, evaluate and watch agents on the rigid-envs environments: `python -m agents`.

An application, not a library: it runs from the checkout and is in no wheel, because PyPI's
`openai-agents` installs a top-level package of the same name.
"""
