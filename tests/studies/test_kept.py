"""Kept steps are right or absent: computed once, kept apart, healed, and they survive a kill."""

import dataclasses
import json
import logging
import multiprocessing
import os
import signal
import time
from pathlib import Path

import pytest

from studies.learning.kept import OnDisk


@dataclasses.dataclass
class Text:
    text: str
    key: str = ""

    def save(self, folder):
        (folder / "value.txt").write_text(self.text)

    @classmethod
    def load(cls, folder, key):
        return cls((folder / "value.txt").read_text(), key)


def run(root, text, name="a", settings=None, code=()):
    compute = text if callable(text) else lambda: Text(text)
    return OnDisk(root).run(name, settings or {}, code, compute, Text.load)


def test_a_step_is_computed_once_per_setting(tmp_path):
    first, again = run(tmp_path, "one", settings={"x": 1}), run(tmp_path, "no", settings={"x": 1})
    other = run(tmp_path, "two", settings={"x": 2})
    assert first == again and first.text == "one" and other.text == "two"


def test_a_failed_step_leaves_nothing_that_counts_as_finished(tmp_path):
    class Half(Text):
        def save(self, folder):
            super().save(folder)
            raise RuntimeError("no")

    with pytest.raises(RuntimeError):
        run(tmp_path, lambda: Half("half"))
    assert run(tmp_path, "whole").text == "whole"
    assert len([path for path in tmp_path.iterdir() if path.is_dir()]) == 1


def test_settings_that_are_no_plain_values_are_refused(tmp_path):
    with pytest.raises(TypeError, match="plain values"):
        run(tmp_path, "", settings={"x": object()})


@pytest.mark.parametrize("harm", ["flip", "cut", "delete", "add"])
@pytest.mark.parametrize("file", ["value.txt", "step.json"])
def test_damage_is_named_set_aside_and_healed(tmp_path, caplog, harm, file):
    made = run(tmp_path, "whole")
    path = tmp_path / made.key / file
    content = path.read_bytes()
    if harm == "delete":
        path.unlink()
    elif harm == "add":
        path.with_suffix(".more").write_text("")
    elif harm == "cut":
        path.write_bytes(content[:-1])
    else:
        path.write_bytes(bytes([content[0] ^ 1]) + content[1:])
    with caplog.at_level(logging.WARNING):
        assert run(tmp_path, "anew").text == "anew"
    assert made.key in caplog.text and "damaged" in caplog.text
    assert len(list((tmp_path / "damaged").iterdir())) == 1
    assert run(tmp_path, "not again").text == "anew"


def test_every_byte_of_the_record_counts(tmp_path):
    made = run(tmp_path, "whole", settings={"x": [1, 2.5, "a"]})
    record = tmp_path / made.key / "step.json"
    content = record.read_bytes()
    for place in range(len(content)):
        record.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :])
        assert run(tmp_path, "anew", settings={"x": [1, 2.5, "a"]}).text == "anew"
        record = tmp_path / made.key / "step.json"


def test_edited_code_is_another_step(tmp_path, monkeypatch):
    (tmp_path / "helper_of_mine.py").write_text("def half(x):\n    return x / 2\n")
    (tmp_path / "mine_edited.py").write_text(
        "from helper_of_mine import half\n\n\nclass Mine:\n    pass\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    import mine_edited

    code = (mine_edited.Mine(),)
    assert run(tmp_path / "kept", "one", code=code).text == "one"
    assert run(tmp_path / "kept", "no", code=code).text == "one"
    # What a module imports counts as well.
    (tmp_path / "helper_of_mine.py").write_text("def half(x):\n    return x / 2.0\n")
    os.utime(tmp_path / "helper_of_mine.py", ns=(1, 1))
    assert run(tmp_path / "kept", "two", code=code).text == "two"


class Slow(Text):
    def save(self, folder):
        super().save(folder)
        Path(self.text).write_text("")
        time.sleep(60)


def _slow(root, marker):
    run(root, lambda: Slow(marker))


def test_a_killed_step_is_computed_again_and_cleaned_up(tmp_path):
    marker = tmp_path / "marker"
    root = tmp_path / "stages"
    process = multiprocessing.get_context("spawn").Process(target=_slow, args=(root, str(marker)))
    process.start()
    while not marker.exists():
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    made = run(root, "whole")
    assert made.text == "whole"
    assert [path.name for path in root.iterdir() if path.is_dir()] == [made.key]
    assert json.loads((root / made.key / "step.json").read_text())["files"]


def test_settings_tell_values_arrays_and_classes_of_parts():
    import numpy as np

    from sims.effects import ViscousFriction
    from sims.pendulum import Pendulum
    from studies.learning.described import modules_in, settings_of

    rubbing, free = Pendulum().with_effects([ViscousFriction("pivot", 1e-4)]), Pendulum()
    assert settings_of(rubbing) != settings_of(free)
    assert ViscousFriction.__module__ in modules_in(settings_of(rubbing))
    before = settings_of(free)
    free.step(np.ones((5, 2)), np.ones((5, 1)))
    assert settings_of(free) == before
    one, other = np.arange(2000.0), np.arange(2000.0)
    other[1000] += 1e-9
    assert settings_of({"a": one}) != settings_of({"a": other})
    gain = 2.0
    assert settings_of(lambda x: gain * x) != settings_of(lambda x: gain * x + 1)
    json.dumps(settings_of([rubbing, one, {1, 2}, Path("a"), Text, None, lambda x: one]))
