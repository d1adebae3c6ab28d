"""The config of a run is what it was started with, or refused; any config starts a new run.

Flipped bits and cut files: `tests/loading`.
"""

from pathlib import Path

import pytest

from agents.cli.command_line import main
from agents.config.entries import Config, config_from, config_to_dict
from agents.config.reading import dump_yaml, parse_yaml
from agents.storage.runs import create_run, read_config, write_config

VALUES = {
    "learning_rate": [1e-3, 1e-4],
    "env_kwargs": {"frame": "reduced", "radius": [0.9, 1.1], "action_delay": 2},
    "cost_price": [0.0, 3e-7],
    "target_kl": 0.02,
}


@pytest.fixture
def config(tmp_path: Path) -> Config:
    return config_from({**VALUES, "log_dir": str(tmp_path), "run_name": "r"})


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("gamma: 0.99", "gamma: 0.9"),
        ("seed: 0", "seed: 1"),
        ("radius: [0.9, 1.1]", "radius: [0.9, 1.5]"),
        ("run_name: r\n", "run_name: s\n"),
        ("target_kl: 0.02\n", ""),
        ("target_kl: 0.02\n", "target_kl: .nan\n"),
        ("target_kl: 0.02\n", "target_kl: 2026-01-01\n"),
    ],
)
def test_a_changed_entry_is_refused_before_the_first_checkpoint(
    config: Config, capsys: pytest.CaptureFixture[str], old: str, new: str
) -> None:
    run = create_run(config)
    run.begin()
    run.close()
    path = run / "config.yaml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    assert main(["train", "--resume", str(run.folder)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"agents: {path}: its entries do not match") and said.count("\n") == 1
    assert f"python -m agents train --config {path}" in said
    assert sorted(each.name for each in run.folder.iterdir()) == ["config.yaml", "run.lock"]


def test_a_changed_config_of_a_run_starts_a_new_one(
    config: Config, capsys: pytest.CaptureFixture[str]
) -> None:
    run = create_run(config)
    run.begin()
    run.close()
    text = (run / "config.yaml").read_text().replace("gamma: 0.99", "gamma: 0.9")
    (run / "config.yaml").write_text(text)
    words = ["train", "--config", str(run / "config.yaml"), "--run_name", "s", "--print-config"]
    assert main(words) == 0
    expected = {**config_to_dict(config), "gamma": 0.9, "run_name": "s"}
    assert parse_yaml(capsys.readouterr().out) == expected


def test_order_notes_and_spelling_are_free(tmp_path: Path, config: Config) -> None:
    path = tmp_path / "config.yaml"
    write_config(path, config)
    head, _, text = path.read_text().partition("\n")
    turned = dump_yaml(dict(reversed(parse_yaml(text).items())))
    assert "3.0e-07" in turned and turned != text
    path.write_text(f"{head}\n# a note\n{turned.replace('3.0e-07', '0.0000003')}")
    assert read_config(path) == config


def test_a_run_of_an_older_version_has_no_digest_and_is_read(
    tmp_path: Path, config: Config
) -> None:
    path = tmp_path / "config.yaml"
    path.write_text(dump_yaml(config_to_dict(config)))
    assert read_config(path) == config
