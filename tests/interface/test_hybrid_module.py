# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python module: a trace is that of the program to the bit; shapes, errors and speed.

Needs HYBRID_PROGRAM (the program) and HYBRID_SCENES (the folder of scenes) in the environment.
"""
import json
import os
import struct
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path

import hybrid
import numpy as np

PROGRAM, SCENES = os.environ["HYBRID_PROGRAM"], Path(os.environ["HYBRID_SCENES"])
BALL = """format = 1
[[rigid]]
name = "ball"
primitive = "ball"
radius = 20
[path]
kind = "press"
from = [0, 0, 40]
to = [0, 0, 10]
"""
BLOCK = BALL.replace(
    "[path]",
    '[[soft]]\nname = "block"\nformula = "block"\nsize = [20, 20, 10]\nspacing = 2\nposition = [40, 0, 0]\n[path]',
)
SOFT_PRESS = np.linspace([0.04, 0, 0.02], [0.04, 0, 0.003], 300)


def recording_of(file):
    """Positions and hashes of a recording's ticks, and its state hash (layout: hybrid/session/recording.cpp)."""
    data = file.read_bytes()
    path_bytes, text_bytes, ticks = struct.unpack_from("<3Q", data, 8)
    (state_hash,) = struct.unpack_from("<Q", data, 72)
    start_m = np.frombuffer(data, "<f8", 3, 80)
    layout = np.dtype([("at_m", "<f8", 3), ("hash", "<u8"), ("fault", "<u4"), ("share", "<u4"), ("arrived", "<u8")])
    return np.frombuffer(data, layout, ticks, 104 + path_bytes + text_bytes), state_hash, start_m


class Trace(unittest.TestCase):
    def test_it_is_that_of_the_program_to_the_bit(self):
        for scene in ("cube", "wall"):
            with self.subTest(scene), tempfile.TemporaryDirectory() as folder:
                recording, report = Path(folder) / "a.rec", Path(folder) / "a.json"
                command = [PROGRAM, "run", SCENES / f"{scene}.toml", "--samples", "0", "--record", recording]
                subprocess.run([*command, "--json", report], check=True, capture_output=True)
                ticks, state_hash, start_m = recording_of(recording)
                self.assertEqual(f"{state_hash:016x}", json.loads(report.read_text())["state_hash"])
                with hybrid.Session(SCENES / f"{scene}.toml") as session:
                    session.begin(start_m)
                    trace = session.play(ticks["at_m"])
                    np.testing.assert_array_equal(trace.hash, ticks["hash"])
                    self.assertEqual(session.state_hash(), state_hash)
                    self.assertGreater(trace.contact_count.max(), 0)

    def test_its_columns_are_views(self):
        with hybrid.Session.from_text(BALL) as session:
            trace = session.play(np.linspace([0, 0, 0.04], [0, 0, 0.02], 100))
        self.assertEqual(trace.shape, (100,))
        self.assertEqual(trace.force_N.shape, (100, 3))
        self.assertTrue(np.shares_memory(trace.force_N, trace))

    def test_single_ticks_are_the_played_path(self):
        with hybrid.Session.from_text(BLOCK) as played, hybrid.Session.from_text(BLOCK) as ticked:
            trace = played.play(SOFT_PRESS)
            for at, row in zip(SOFT_PRESS, trace):
                self.assertEqual(ticked.tick(at, orientation=(1, 0, 0, 0)).hash, row.hash)
            self.assertEqual(ticked.state_hash(), played.state_hash())


class Values(unittest.TestCase):
    def test_objects_and_surfaces_have_their_shapes(self):
        with hybrid.Session.from_text(BLOCK) as session:
            self.assertEqual([(o.name, o.is_soft) for o in session.objects], [("ball", False), ("block", True)])
            rest = session.surfaces()
            session.play(SOFT_PRESS)
            pressed = session.surfaces()
            self.assertEqual(pressed[1].shape, (session.objects[1].vertices, 3))
            self.assertLess(session.triangles("block").max(), session.objects[1].vertices)
            np.testing.assert_array_equal(rest[0], pressed[0])
            self.assertGreater(np.abs(rest[1] - pressed[1]).max(), 5e-4)
            self.assertGreater(session.object_force("block")[2], 0)

    def test_an_edit_of_the_stiffness_is_felt(self):
        with hybrid.Session.from_text(BALL.replace("[path]", '[device]\nmodel = "ideal"\n[path]')) as session:
            path = np.concatenate([np.linspace([0, 0, 0.04], [0, 0, 0.021], 200), np.full((300, 3), [0, 0, 0.021])])
            self.assertAlmostEqual(session.play(path).force_N[-1, 2], 1000 * 0.001, 6)  # touched at 22 mm
            session.edit("stiffness", 2000)
            self.assertAlmostEqual(session.play(path[-300:]).force_N[-1, 2], 2000 * 0.001, 6)

    def test_a_recording_replays(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "a.rec"
            with hybrid.Session.from_text(BLOCK, folder, record=300) as session:
                session.play(SOFT_PRESS)
                session.save_recording(file)
                hash_now = session.state_hash()
            said = subprocess.run([PROGRAM, "replay", file], check=True, capture_output=True, text=True).stdout
            self.assertIn(f"equal: 300 ticks, state hash {hash_now:016x}", said)

    def test_the_error_is_measured(self):
        with hybrid.Session.from_text(BLOCK, record=300, error=True) as session:
            session.play(SOFT_PRESS)
            error = session.measure_error()
        self.assertGreater(error.samples, 0)
        self.assertGreaterEqual(error.max_jnd, error.p99_jnd)


class Errors(unittest.TestCase):
    def refused(self, code, words, call):
        with self.assertRaises(hybrid.Error) as caught:
            call()
        self.assertEqual(caught.exception.code, code)
        self.assertIn(words, str(caught.exception))
        self.assertIn(";", str(caught.exception), "no remedy")

    def test_each_has_a_code_and_a_remedy(self):
        self.refused("HYBRID_REFUSED", "gone.toml", lambda: hybrid.Session("gone.toml"))
        self.refused("HYBRID_REFUSED", "<text>:1:1", lambda: hybrid.Session.from_text("format = 3\n"))
        self.refused("HYBRID_BAD_VALUE", "relaxation", lambda: hybrid.Session.from_text(BALL, relaxation="none"))
        self.refused("HYBRID_BAD_VALUE", "rate_hz", lambda: hybrid.Session.from_text(BALL, rate_hz=1.0))
        session = hybrid.Session.from_text(BALL)
        self.refused("HYBRID_REFUSED", "inside something rigid", lambda: session.tick([0, 0, 0]))
        self.refused("HYBRID_BAD_VALUE", "shape", lambda: session.tick([0, 0]))
        self.refused("HYBRID_BAD_VALUE", "shape", lambda: session.play([0, 0, 1]))
        session.begin([0, 0, 0.04])
        self.refused("HYBRID_BAD_VALUE", "finite", lambda: session.tick([0, 0, float("nan")]))
        self.refused("HYBRID_BAD_VALUE", "dt_s", lambda: session.tick([0, 0, 1], 5.0))
        self.refused("HYBRID_NOT_FOUND", "'cube'", lambda: session.object_force("cube"))
        self.refused("HYBRID_NOT_FOUND", "ball damping", lambda: session.edit("mass", 1.0, "ball"))
        self.refused("HYBRID_NOT_AVAILABLE", "recorded_ticks", lambda: [session.tick([0, 0, 1]), session.save_recording("a")])
        session.close()
        self.refused("HYBRID_CLOSED", "open another", lambda: session.tick([0, 0, 1]))


class Speed(unittest.TestCase):
    def test_play_does_a_hundred_thousand_ticks_a_second(self):
        path = np.tile(np.linspace([0.01, 0, 0.04], [0, 0, 0.019], 1000), (20, 1))
        with hybrid.Session.from_text(BALL, surfaces=False) as session:
            session.begin(path[0])
            rates, wall = [], []
            for _ in range(5):  # in processor time, because other programs may run
                start, now = time.thread_time(), time.perf_counter()
                trace = session.play(path)
                rates.append(len(path) / (time.thread_time() - start))
                wall.append(len(path) / (time.perf_counter() - now))
            start = time.thread_time()
            for at in path[:2000]:
                session.tick(at)
            single = 2000 / (time.thread_time() - start)
        self.assertGreater(np.mean(trace.contact_count > 0), 0.1)
        print(f"play: {max(rates):.3g} ticks a second ({max(wall):.3g} by the wall clock), tick: {single:.3g}")
        self.assertGreater(max(rates), 1e5)

    def test_other_threads_run_while_it_plays(self):
        path, counted, over = np.full((50_000, 3), [0, 0, 0.021]), [0], threading.Event()

        def count():
            while not over.is_set():
                counted[0] += 1
                time.sleep(1e-4)

        with hybrid.Session.from_text(BALL) as session:
            session.begin([0, 0, 0.04])
            thread = threading.Thread(target=count)
            thread.start()
            before = counted[0]
            session.play(path)
            after = counted[0]
            over.set()
            thread.join()
        self.assertGreater(after - before, 5)


if __name__ == "__main__":
    unittest.main()
