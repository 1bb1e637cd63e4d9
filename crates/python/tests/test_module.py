"""The module itself: quick to import, and interrupted by Ctrl-C."""

from __future__ import annotations

import doctest
import importlib
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import chainwave as cw
import pytest
from conftest import film

PROGRAM = """
from conftest import film
import chainwave as cw
import numpy as np
frames = np.concatenate([film(10, 320, 240)] * 30)
points = [{"name": str(i), "x_px": 60 + 20 * i, "y_px": 120, "half_width_px": 40, "half_height_px": 40} for i in range(10)]
print("ready", flush=True)
cw.track(frames, points, threads=1, shape="quadratic")
print("done", flush=True)
"""


def test_import_is_quick_and_leaves_numpy_alone() -> None:
    measure = "import time; start = time.process_time(); import chainwave; print(time.process_time() - start, 'numpy' in sys.modules)"
    runs = [
        subprocess.run([sys.executable, "-c", f"import sys; {measure}"], check=True, capture_output=True, text=True)
        for _ in range(5)
    ]
    seconds, with_numpy = zip(*(run.stdout.split() for run in runs))
    assert set(with_numpy) == {"False"}
    if os.getloadavg()[0] > (os.cpu_count() or 1):
        pytest.skip("the machine has other work: times say nothing")
    assert min(map(float, seconds)) < 0.1


def test_the_command_comes_along(command: str) -> None:
    said = subprocess.run([command, "--version"], check=True, capture_output=True, text=True).stdout
    assert said == f"chainwave {cw.__version__}\n"


def test_examples_in_the_documentation_hold() -> None:
    modules = ["_estimate", "_experiment", "_models", "_pieces", "_recording", "_strain", "_table", "_tracking"]
    results = [doctest.testmod(importlib.import_module(f"chainwave.{name}")) for name in modules]
    assert sum(result.attempted for result in results) > 0 and not any(result.failed for result in results)
    assert all(getattr(cw, name).__doc__ for name in cw.__all__ if name != "__version__")


def test_other_threads_go_on_while_work_is_done() -> None:
    frames = film(12, 320, 240)
    points = [{"name": str(i), "x_px": 60 + 20 * i, "y_px": 120, "half_width_px": 40, "half_height_px": 40} for i in range(10)]
    beats: list[float] = []
    is_done = threading.Event()

    def beat() -> None:
        while not is_done.wait(1e-3):
            beats.append(time.perf_counter())

    other = threading.Thread(target=beat)
    start = time.perf_counter()
    other.start()
    cw.track(frames, points, threads=1, shape="quadratic")
    is_done.set()
    other.join()
    took_s = time.perf_counter() - start
    # A lock that is held lets a waiting thread in every 5 ms at best, and compiled code that holds it not at all. Half of the work may
    # be spent in Python before and after, and a machine with other work may pause; in what remains it must have gone on.
    during = [beat for beat in beats if 0.25 * took_s < beat - start < 0.75 * took_s]
    assert len(during) >= 5, f"{len(during)} beats in {0.5 * took_s:.3f} s"


def test_ctrl_c_ends_work_at_once() -> None:
    pipe = subprocess.PIPE
    work = subprocess.Popen([sys.executable, "-c", PROGRAM], stdout=pipe, stderr=pipe, text=True, cwd=Path(__file__).parent)
    assert work.stdout is not None and work.stdout.readline() == "ready\n"
    time.sleep(1.0)
    start = time.perf_counter()
    work.send_signal(signal.SIGINT)
    told, complaint = work.communicate(timeout=60)
    assert told == "" and "KeyboardInterrupt" in complaint
    assert time.perf_counter() - start < 5.0
