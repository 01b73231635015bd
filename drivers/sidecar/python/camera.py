#!/usr/bin/env python3
"""A camera beside any rig: frames go into a file of their own, and only their numbers to palpate, on palpate's clock.

It needs no camera: it draws its frames. REPLACE `picture` with yours. In a rig file:

    [sensors.camera]
    program = ["python3", "camera.py", "--out", "frames"]

The folder gets `frames-BOOT.pgm`, the pictures one after the other (netpbm, which ffmpeg and others read), and
`frames-BOOT.jsonl`, a line for each: number, clock in microseconds as in palpate's raw lines (32 bits), wall clock, and where its
picture begins. The session has the channel `camera.frame`: the number of the newest frame, with its age.

SPDX-License-Identifier: MIT OR Apache-2.0, as all of palpate.
"""
import json
import pathlib
import sys
import time

from palpate_sidecar import Sidecar

WIDTH, HEIGHT = 64, 48


def picture(number):
    """Its number in binary, a column of four pixels for each bit."""
    row = bytes(255 if number >> (column // 4) & 1 else 32 for column in range(WIDTH))
    return row * HEIGHT


class Camera(Sidecar):
    name = "camera"
    rate = 30
    binary = False
    sensors = [{"name": "frame", "unit": "1"}]

    def __init__(self, folder):
        self.folder, self.number, self.files = pathlib.Path(folder), 0, None

    def sample(self):
        if self.files is None:
            self.folder.mkdir(parents=True, exist_ok=True)
            self.files = [open(self.folder / f"frames-{self.boot}.{ending}", "xb") for ending in ("pgm", "jsonl")]
        pictures, index = self.files
        self.number += 1
        about = {"frame": self.number, "t": self.ticks(), "wall": time.time(), "at": pictures.tell()}
        pictures.write(b"P5 %d %d 255\n" % (WIDTH, HEIGHT) + picture(self.number))
        index.write(json.dumps(about).encode() + b"\n")
        for file in self.files:
            file.flush()
        return {"t": about["t"], "v": [self.number]}


if __name__ == "__main__":
    arguments = sys.argv[1:]
    folder = arguments[arguments.index("--out") + 1] if "--out" in arguments else "frames"
    rest = [word for index, word in enumerate(arguments) if word != "--out" and arguments[index - 1 : index] != ["--out"]]
    Camera(folder).run(rest)
