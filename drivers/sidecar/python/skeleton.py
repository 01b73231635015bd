#!/usr/bin/env python3
"""my-sidecar: a stage with a load cell for palpate. As it is, stage and cell are simulated: replace the marked lines."""
import math
import random
import time

from palpate_sidecar import HOME, MOTOR_ON, MOVING, STOPPING, Refused, Sidecar, Trapezoid

MM_PER_PULSE = 0.0025
HOME_MM = -5.0  # where the home switch closes, from where the stage was switched on


class Stage(Sidecar):
    name = "my-sidecar"
    rate = 200
    axis = {"mm_per_pulse": MM_PER_PULSE, "travel_mm": 60, "speed_max": 10, "acceleration": 50, "lag_ms": 5}
    cell = {"counts_min": -8388608, "counts_max": 8388607, "volts_per_count": 5 / 2**23, "noise_v": 3e-4}
    sensors = [{"name": "temperature", "unit": "°C"}]

    def __init__(self):
        self.path, self.motor, self.samples = Trapezoid(), False, 0

    def enable(self):
        self.motor = True  # REPLACE: switch the motor on

    def move(self, to, speed, acceleration):
        if not self.motor:
            raise Refused("the motor is off")
        self.path.move(to * MM_PER_PULSE, speed, acceleration)  # REPLACE: begin the motion

    def stop(self):
        self.path.stop()  # REPLACE: brake

    def halt(self):
        self.path.halt()  # REPLACE: cut the motion

    def moving(self):
        return self.path.moving()  # REPLACE: ask the drive

    def sample(self):
        moving, mm = self.path.moving(), self.path.now()  # REPLACE: read the position
        force = max(0.0, mm - 20.0) * 0.2  # REPLACE: read the load cell, here a spring of 0.2 N/mm at 20 mm
        volts = 1.28 + 0.4 * force + random.gauss(0, 2e-4)
        status = MOVING * moving + STOPPING * (moving and self.path.stopping)
        status += HOME * (mm <= HOME_MM) + MOTOR_ON * self.motor  # REPLACE: read the switches
        sample = {"c": round(volts / self.cell["volts_per_count"]), "p": round(mm / MM_PER_PULSE), "s": status}
        self.samples += 1
        if self.samples % 100 == 0:
            sample["v"] = [21.5 + 0.5 * math.sin(time.monotonic() / 60)]  # REPLACE: read the thermometer
        return sample


if __name__ == "__main__":
    Stage().run()
