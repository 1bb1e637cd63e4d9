"""The module itself: quick to import, and interrupted by Ctrl-C."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

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
    program = "import sys, time; start = time.perf_counter(); import chainwave; print(time.perf_counter() - start, 'numpy' in sys.modules)"
    runs = [subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True) for _ in range(3)]
    seconds, with_numpy = zip(*(run.stdout.split() for run in runs))
    assert min(map(float, seconds)) < 0.1 and set(with_numpy) == {"False"}


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
