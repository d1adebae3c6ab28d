"""What TensorBoard gets goes to a tracker too, if it is asked for."""

import sys
from importlib.machinery import ModuleSpec
from types import ModuleType
from unittest.mock import MagicMock

import numpy as np
import pytest

from agents.cli.command_line import main
from tests.agents.sessions import SMALL

WORDS = [word for key, value in SMALL.items() for word in (f"--{key}", str(value))]
TRAIN = ["train", *WORDS, "--total_timesteps", "1024", "--quiet", "--allow-import"]
TRAIN += ["tests.agents.drift", "--run_name", "r"]


def fake(name, monkeypatch):
    """A package that notes what is asked of it."""
    package = MagicMock(spec=ModuleType(name))
    calls = ("init", "set_experiment", "start_run", "log_params", "log_metrics", "end_run")
    package.configure_mock(**{each: MagicMock() for each in calls}, __spec__=ModuleSpec(name, None))
    monkeypatch.setitem(sys.modules, name, package)
    return package


def test_a_training_is_a_run_of_weights_and_biases(tmp_path, monkeypatch):
    wandb = fake("wandb", monkeypatch)
    assert main([*TRAIN, "--logger", "wandb", "--log_dir", str(tmp_path)]) == 0
    ((), about), run = wandb.init.call_args, wandb.init.return_value
    assert (about["project"], about["name"], about["config"]["n_envs"]) == ("rigid-envs", "r", 16)
    assert [call.kwargs["step"] for call in run.log.call_args_list] == [512, 1024]
    assert "eval/success_rate" in run.log.call_args.args[0]
    run.finish.assert_called_once_with()


def test_a_training_is_a_run_of_mlflow(tmp_path, monkeypatch):
    mlflow = fake("mlflow", monkeypatch)
    assert main([*TRAIN, "--logger", "mlflow", "--log_dir", str(tmp_path)]) == 0
    mlflow.start_run.assert_called_once_with(run_name="r")
    assert mlflow.log_params.call_args.args[0]["env_id"] == "Drift-v0"
    assert [call.kwargs["step"] for call in mlflow.log_metrics.call_args_list] == [512, 1024]
    values = mlflow.log_metrics.call_args.args[0]
    assert "eval/success_rate" in values and all(np.isfinite(list(values.values())))
    mlflow.end_run.assert_called_once_with()


@pytest.mark.parametrize("name", ["wandb", "mlflow"])
def test_a_tracker_that_is_not_installed_is_told_before_anything_is_made(
    tmp_path, monkeypatch, capsys, name
):
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    assert main([*TRAIN, "--logger", name, "--log_dir", str(tmp_path)]) == 1
    assert f"{name} is not installed; get it with: pip install '{name}'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
