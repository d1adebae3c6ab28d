"""Search of hyperparameters, as a YAML file describes it: a recipe in which values are ranges."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rigid_envs.base import settings
from rigid_envs.base.checks import named_refusal
from rigid_envs.base.settings import Integer, Keywords, List, refusal, setting

from .entries import Config, config_from
from .reading import frame_of, read_yaml, recipe_for

FIGURES = {"success_rate": "max", "mean_reward": "max", "mean_cost": "min"}
"""What may be searched for, in the last evaluation of a training, and which way."""

_RANGES = ({"low", "high"}, {"low", "high", "log"}, {"low", "high", "step"}, {"choices"})


@dataclass(frozen=True, kw_only=True)
class Search(settings.Settings):
    """A search of hyperparameters."""

    trials: int = setting(20, Integer("values of the ranges that are tried", 1, 100_000))
    seeds: tuple[int, ...] = setting(
        (0,),
        List(
            "seeds that each is trained with; figures are means", Integer("", 0, 2**63 - 1), 1, 100
        ),
    )
    objective: Mapping[str, Any] = setting(
        {"success_rate": "max", "mean_cost": "min"},
        Keywords(f"what is searched for: some of {FIGURES}; of several, all best compromises"),
    )
    recipe: Mapping[str, Any] = setting(
        {}, Keywords("entries over those of the recipe of `env_id`; any value may be a range")
    )

    def __post_init__(self) -> None:
        """Check all, and that a config can be made of it.

        Raises:
            ConfigError: "config.<key>: ...".
        """
        settings.check_fields(self)
        if not self.objective or not self.objective.items() <= FIGURES.items():
            raise refusal("objective", dict(self.objective), f"some of {FIGURES}")
        if not self.ranges():
            raise refusal("recipe", dict(self.recipe), "a range: {low: 1e-4, high: 1e-2}")
        for end in (0, -1):
            ends = {name: _values(each)[end] for name, each in self.ranges().items()}
            self.config(ends)

    def ranges(self) -> dict[str, Mapping[str, Any]]:
        """The ranges, as YAML gives them, by the path of their entry: "learning_rate.0"."""
        found: dict[str, Mapping[str, Any]] = {}
        _filled(self.recipe, found.setdefault)
        for name, value in found.items():
            _refuse_range(f"recipe.{name}", value)
        return found

    def config(self, values: Mapping[str, Any], **entries: Any) -> Config:
        """A config with values for the ranges.

        Args:
            values: Values by path.
            **entries: Other entries over all.

        Raises:
            ConfigError: One that cannot be.
        """
        own = _filled(self.recipe, lambda name, given: values.get(name, given))
        base = recipe_for(str(own.get("env_id", "BallPark")), own.get("algo"), frame_of(own, {}))
        return config_from({**base, **own, **entries})


def read_search(path: Path) -> Search:
    """The search of a YAML file.

    Args:
        path: The file.

    Raises:
        ConfigError: Something in it that cannot be; names the file.
    """
    with named_refusal(path):
        return settings.from_config(Search, read_yaml(path))


def _filled(node: Any, value_of: Callable[[str, Mapping[str, Any]], Any], path: str = "") -> Any:
    """Nested mappings and lists with other values for the ranges, by their path."""
    if isinstance(node, Mapping) and set(node) in _RANGES:
        return value_of(path, node)
    start = f"{path}." if path else ""
    if isinstance(node, Mapping):
        return {key: _filled(each, value_of, f"{start}{key}") for key, each in node.items()}
    if isinstance(node, list | tuple):
        return [_filled(each, value_of, f"{start}{k}") for k, each in enumerate(node)]
    return node


def _refuse_range(key: str, given: Mapping[str, Any]) -> None:
    """Refuse a range without values.

    Raises:
        ConfigError: "config.recipe.<path>: ...".
    """
    if "choices" in given:
        if not isinstance(given["choices"], list) or not given["choices"]:
            raise refusal(key, given, "a list of choices")
        return
    low, high, step, log = (given.get(name) for name in ("low", "high", "step", "log"))
    numbers = [each for each in (low, high, step) if each is not None]
    if (
        not all(isinstance(each, (int, float)) and not isinstance(each, bool) for each in numbers)
        or log not in (None, True, False)
        or not given["low"] < given["high"]
        or (log and given["low"] <= 0)
        or (step is not None and not 0 < step <= given["high"] - given["low"])
    ):
        raise refusal(key, given, "numbers low < high, step > 0, and low > 0 with log: true")


def _values(given: Mapping[str, Any]) -> list[Any]:
    """The ends of a range, or all choices."""
    return given.get("choices") or [given["low"], given["high"]]
