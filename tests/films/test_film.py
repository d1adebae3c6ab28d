"""Films are what they say, in formats that others read, and nothing half-written stays."""

import re
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled

from rigid_envs.watch import films
from rigid_envs.watch.films import SUFFIXES, checked_film, write_film
from rigid_envs.watch.pictures import pillow
from tests.programs import printed
from tests.refusals import refusal, refuses

imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
Image = pytest.importorskip("PIL.Image")

FPS = 25.0


def moving_square(n=20, height=48, width=64):
    """Pictures of an orange square on a blue ground, one pixel further in each."""
    pictures = []
    for k in range(n):
        picture = np.full((height, width, 3), (40, 80, 160), dtype=np.uint8)
        picture[10:26, k : k + 16] = (230, 160, 30)
        pictures.append(picture)
    return pictures


def noise(n=20, size=40):
    rng = np.random.default_rng(0)
    return list(rng.integers(0, 256, (n, size, size, 3), dtype=np.uint8))


def read_video(path):
    reader = imageio_ffmpeg.read_frames(str(path))
    meta = next(reader)
    width, height = meta["size"]
    return meta, [np.frombuffer(raw, np.uint8).reshape(height, width, 3) for raw in reader]


def read_animation(path):
    """Pictures, the time [s] at which each begins and the last one ends, and the loop count."""
    with Image.open(path) as film:
        pictures, times = [], [0.0]
        for k in range(film.n_frames):
            film.seek(k)
            pictures.append(np.asarray(film.convert("RGB")))
            times.append(times[-1] + film.info["duration"] / 1000)
        return pictures, times, film.info.get("loop", -1)


def test_mp4_is_h264_in_yuv420p_with_every_picture_written_without_a_word(tmp_path, caplog, capfd):
    pictures = moving_square()
    film = write_film(tmp_path / "a.mp4", pictures, FPS)
    assert not caplog.records and capfd.readouterr() == ("", "")
    meta, shown = read_video(film.path)
    assert meta["codec"] == "h264" and meta["pix_fmt"].startswith("yuv420p")
    assert meta["fps"] == FPS and meta["size"] == (64, 48) == (film.width, film.height)
    assert len(shown) == film.n_pictures == 20
    assert film.n_bytes == film.path.stat().st_size
    for ours, theirs in zip(pictures, shown, strict=True):
        assert np.abs(ours.astype(int) - theirs.astype(int)).mean() < 6


def test_mp4_begins_with_its_index_so_that_a_browser_can_start_at_once(tmp_path):
    data = write_film(tmp_path / "a.mp4", moving_square(), FPS).path.read_bytes()
    assert 0 < data.find(b"moov") < data.find(b"mdat")


@pytest.mark.parametrize("size", [(47, 63), (47, 64), (48, 63)])
def test_mp4_of_odd_size_repeats_its_last_line_or_column(tmp_path, size):
    pictures = moving_square(5, *size)
    film = write_film(tmp_path / "a.mp4", pictures, FPS)
    assert (film.width, film.height) == (64, 48)
    for ours, theirs in zip(pictures, read_video(film.path)[1], strict=True):
        ours = ours[np.minimum(np.arange(48), size[0] - 1)]
        ours = ours[:, np.minimum(np.arange(64), size[1] - 1)]
        assert np.abs(ours.astype(int) - theirs.astype(int)).mean() < 6


def test_mp4_is_encoded_while_pictures_come(tmp_path):
    alive = most = 0

    class Counted(np.ndarray[Any, Any]):
        def __del__(self):
            nonlocal alive
            alive -= 1

    def source():
        nonlocal alive, most
        for picture in moving_square(40):
            alive += 1
            most = max(most, alive)
            yield picture.copy().view(Counted)

    write_film(tmp_path / "a.mp4", source(), FPS)
    assert most <= 4


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_an_animation_repeats_without_end_and_keeps_the_time(tmp_path, suffix):
    pictures = moving_square(31)
    film = write_film(tmp_path / f"a{suffix}", pictures, 30.0)
    shown, times, loop = read_animation(film.path)
    assert loop == 0
    assert times[-1] == pytest.approx(31 / 30, abs=0.011)
    assert film.duration == pytest.approx(31 / 30)
    for picture, time in zip(shown, times, strict=False):  # no drift, whatever is rounded
        due = pictures[round(time * 30)]
        assert np.abs(due.astype(int) - picture.astype(int)).mean() < 6


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_one_picture_is_a_film(tmp_path, suffix):
    film = write_film(tmp_path / f"a{suffix}", moving_square(1), FPS)
    assert (film.n_pictures, film.width, film.height) == (1, 64, 48)


@pytest.mark.parametrize(
    ("suffix", "fps", "kept"),
    [(".gif", 50.0, 30), (".gif", 60.0, 15), (".gif", 100.0, 15), (".webp", 60.0, 30)],
)
def test_a_gif_alone_leaves_pictures_out_above_50_a_second(tmp_path, suffix, fps, kept):
    film = write_film(tmp_path / f"a{suffix}", moving_square(30), fps)
    assert film.fps == pytest.approx(fps * kept / 30) and film.n_pictures == kept
    tick = 0.01 if suffix == ".gif" else 0.001  # [s], in which the format counts
    due = np.append(np.arange(0, 30, 30 // kept), 30) / fps
    assert np.allclose(read_animation(film.path)[1], due, rtol=0.0, atol=0.51 * tick)


def test_no_picture_of_a_gif_is_shown_for_less_than_a_fiftieth_of_a_second(tmp_path):
    film = write_film(tmp_path / "a.gif", moving_square(31), 100.0)  # the last one was alone
    assert np.diff(read_animation(film.path)[1]) == pytest.approx(0.02)


def test_where_ffmpeg_writes_nothing_that_is_said(tmp_path, monkeypatch):
    def writer(*_, **options):
        while True:
            yield

    monkeypatch.setattr(films, "load_ffmpeg", lambda: SimpleNamespace(write_frames=writer))
    with pytest.raises(OSError, match=r"a\.mp4: ffmpeg wrote nothing"):
        write_film(tmp_path / "a.mp4", moving_square(2), FPS)


def test_a_gif_has_no_more_colours_than_its_level(tmp_path):
    shown = read_animation(write_film(tmp_path / "a.gif", noise(3), FPS).path)[0]
    assert len(np.unique(np.reshape(shown, (-1, 3)), axis=0)) <= 256


def test_a_webp_has_all_colours_of_all_pictures(tmp_path):
    pictures = noise(40, 1)
    shown = read_animation(write_film(tmp_path / "a.webp", pictures, FPS).path)[0]
    assert np.abs(np.subtract(shown, pictures, dtype=int)).max() < 8


def test_each_level_of_quality_has_fewer_pixels_a_second_than_the_one_before():
    sizes = [level.scale**2 * level.fps for level in films._LEVELS]
    assert sizes == sorted(set(sizes), reverse=True)  # it is searched by bisection


# to look for a palette takes long
GIF = pytest.param(".gif", marks=pytest.mark.long)


@pytest.mark.parametrize("suffix", [GIF, ".webp"])
def test_max_bytes_lowers_the_quality_and_says_so_but_not_the_duration(tmp_path, suffix):
    best = write_film(tmp_path / f"best{suffix}", noise(), FPS)
    small = write_film(tmp_path / f"small{suffix}", noise(), FPS, best.n_bytes // 3)
    assert small.n_bytes <= best.n_bytes // 3 < best.n_bytes
    assert small.width * small.fps < best.width * best.fps
    assert small.duration == pytest.approx(best.duration)
    shown, times, _ = read_animation(small.path)
    assert shown[0].shape == (small.height, small.width, 3)
    assert times[-1] == pytest.approx(best.duration, abs=0.011)


@pytest.mark.parametrize("suffix", [GIF, ".webp"])
def test_max_bytes_that_cannot_be_met_is_refused_with_the_least_size(tmp_path, suffix):
    with pytest.raises(ValueError, match=r"max_bytes = 1; expected at least \d+, the size"):
        write_film(tmp_path / f"a{suffix}", noise(), FPS, 1)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("height", "width"), [(1, 40), (40, 1)])
def test_the_least_size_that_a_refusal_names_is_enough(tmp_path, height, width):
    thin = [picture[:height, :width] for picture in noise()]
    told = refusal(write_film, tmp_path / "a.webp", thin, FPS, 1)
    (least,) = re.findall(r"expected at least (\d+)", told)
    film = write_film(tmp_path / "a.webp", thin, FPS, int(least))
    assert film.n_bytes == int(least)
    assert (film.height, film.width) == (min(height, 14), min(width, 14))  # 0.35 of 40


def test_a_colour_that_comes_in_the_end_alone_is_seen_in_a_gif(tmp_path):
    pictures = [np.full((8, 8, 3), (40, 80, 160), np.uint8) for _ in range(4)]
    pictures.append(np.full((8, 8, 3), (230, 160, 30), np.uint8))
    pictures[-1][:, :4] = pictures[-1][:4] = (20, 120, 40)
    shown, _, _ = read_animation(write_film(tmp_path / "a.gif", pictures, FPS).path)
    for picture, due in zip((shown[0], shown[-1]), (pictures[0], pictures[-1]), strict=True):
        assert np.abs(picture.astype(int) - due.astype(int)).max() < 6


@pytest.mark.parametrize(
    ("name", "max_bytes", "message"),
    [
        ("a.avi", None, r"a\.avi'; expected a name that ends in \.mp4, \.gif or \.webp"),
        ("a", None, "expected a name that ends in"),
        ("nowhere/a.mp4", None, "expected a file in a folder that exists"),
        ("folder.gif", None, "expected a file: this is a folder"),
        ("a.mp4", 9, "max_bytes = 9; expected None for an mp4"),
        *(
            ("a.webp", bad, f"^max_bytes = {bad!r}; expected an integer of at least")
            for bad in (0, -1, 2.5, True, "1")
        ),
    ],
)
def test_another_file_or_size_is_refused(tmp_path, name, max_bytes, message):
    (tmp_path / "folder.gif").mkdir()
    refuses(message, write_film, tmp_path / name, moving_square(), FPS, max_bytes)


@pytest.mark.parametrize(
    ("pictures", "fps", "message"),
    [
        ([], FPS, r"pictures = \(\); expected at least one"),
        (moving_square(1), 0.0, "fps = 0.0; expected a positive"),
        ([moving_square(1)[0] / 2.0], FPS, r"pictures\[0\] = ndarray; expected uint8"),
        ([np.zeros((4, 4), np.uint8)], FPS, r"pictures\[0\] has shape \(4, 4\); expected"),
        (
            [*moving_square(2), np.zeros((4, 4, 3), np.uint8)],
            FPS,
            r"pictures\[2\] has shape \(4, 4, 3\); expected \(48, 64, 3\)",
        ),
    ],
)
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_is_no_film_is_refused_and_leaves_nothing(tmp_path, suffix, pictures, fps, message):
    refuses(message, write_film, tmp_path / f"a{suffix}", pictures, fps)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_failure_on_the_way_leaves_the_old_film(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"old")

    def source():
        yield from moving_square(5)
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        write_film(path, source(), FPS)
    assert path.read_bytes() == b"old" and len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(
    ("suffix", "module"),
    [(".mp4", "imageio_ffmpeg"), (".gif", "PIL.Image"), (".webp", "PIL.Image")],
)
def test_without_the_extra_it_says_what_to_install(tmp_path, suffix, module, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    pillow.cache_clear()
    for act in (checked_film, lambda path: write_film(path, moving_square(), FPS)):
        with pytest.raises(DependencyNotInstalled, match=r'pip install "rigid-envs\[render\]"'):
            act(tmp_path / f"a{suffix}")


@pytest.mark.long
def test_importing_films_imports_no_renderer():
    code = (
        "import sys, rigid_envs.watch.films; "
        "assert not {'PIL', 'panda3d', 'pygame', 'imageio_ffmpeg', 'moviepy'} & set(sys.modules)"
    )
    printed("-c", code)
