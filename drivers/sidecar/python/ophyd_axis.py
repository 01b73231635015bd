#!/usr/bin/env python3
"""ophyd-async devices as a sidecar: a motor is the axis, a signal is the load cell, other signals are sensors.

Tested with ophyd-async 0.21. As it is, motor and signals are simulated: REPLACE `devices` with yours, such as an EPICS motor
record. The reported position is the commanded one, a trapezoid with the speed and the acceleration that the motor is set to; a
motor whose readback is further from it than TOLERANCE_MM is a fault.

SPDX-License-Identifier: MIT OR Apache-2.0, as all of palpate.
"""
import asyncio
import concurrent.futures
import os
import threading
import time

from ophyd_async.core import init_devices, soft_signal_r_and_setter
from ophyd_async.sim import SimMotor

from palpate_sidecar import HOME, MOTOR_ON, MOVING, STOPPING, Refused, Sidecar, Trapezoid

MM_PER_PULSE = 0.001
TOLERANCE_MM = 1.5  # the simulated motor reports ten times a second
HOME_MM = -5.0
STOP_MAX = 2.0  # seconds in which the motor obeys a stop


async def devices():
    """The motor, the signal of the load cell in V, and a sensor."""
    async with init_devices():
        motor = SimMotor("stage", instant=False)
    volts, _ = soft_signal_r_and_setter(float, 1.28, units="V", name="volts")
    temperature, _ = soft_signal_r_and_setter(float, 21.5, units="°C", name="temperature")
    return motor, volts, temperature


class OphydAxis(Sidecar):
    name = "ophyd-stage"
    rate = 100
    axis = {"mm_per_pulse": MM_PER_PULSE, "travel_mm": 60, "speed_max": 5, "acceleration": 20, "lag_ms": 10}
    cell = {"counts_min": -8388608, "counts_max": 8388607, "volts_per_count": 5 / 2**23, "noise_v": 3e-4}
    sensors = [{"name": "temperature", "unit": "°C"}]

    def __init__(self):
        self.path, self.on, self.newest, self.error, self.count = Trapezoid(), False, {}, None, 0
        # A motion is begun on the thread of asyncio and stopped on the one of palpate's lines. `lock` keeps together what belongs
        # together: the number of stops, and the computed path.
        self.lock, self.stops, self.brakes, self.braking = threading.Lock(), 0, 0, None
        self.beginning, self.motion = False, None
        self.loop = asyncio.new_event_loop()
        threading.Thread(target=self.loop.run_forever, name="ophyd", daemon=True).start()
        self.motor, volts, temperature = self.later(devices()).result()
        for key, signal in {"mm": self.motor.user_readback, "volts": volts, "temperature": temperature}.items():
            self.newest[key] = self.later(signal.get_value()).result()
            self.loop.call_soon_threadsafe(signal.subscribe, lambda reading, key=key: self.keep(key, reading))

    def later(self, coroutine):
        return asyncio.run_coroutine_threadsafe(coroutine, self.loop)

    def keep(self, key, reading):
        self.newest[key] = next(iter(reading.values()))["value"]

    async def begin(self, stops, mm, speed, acceleration):
        try:
            while self.brakes:  # what still stops the motion before is not to stop this one
                await asyncio.sleep(0.01)
            await self.motor.velocity.set(speed)
            await self.motor.acceleration_time.set(speed / acceleration)
            with self.lock:
                if stops == self.stops:  # no stop has come meanwhile
                    self.path.move(mm, speed, acceleration)
                    self.motion = self.motor.set(mm)
                self.beginning = False
            if stops == self.stops:
                await self.motion
        except Exception as error:  # a stop ends the motion with an error; others are reported with the next sample
            self.error = self.error or (error if stops == self.stops else None)
        finally:
            self.beginning = False

    async def brake(self):
        """Stops the motor; again while its motion goes on, because `set` may write the target after the first stop."""
        motion, until = self.motion, time.monotonic() + STOP_MAX
        self.brakes += 1
        try:
            await asyncio.wait_for(self.motor.stop(success=False), STOP_MAX)
            while motion is not None and not motion.done:
                if time.monotonic() > until:
                    raise RuntimeError(f"the motor does not stop within {STOP_MAX} s")
                await asyncio.sleep(0.02)
                await asyncio.wait_for(self.motor.stop(success=False), STOP_MAX)
        except Exception as error:
            self.error = self.error or error
        finally:
            self.brakes -= 1

    def enable(self):
        self.on = True

    def move(self, to, speed, acceleration):
        if not self.on:
            raise Refused("the motor is off")
        self.beginning = True
        self.later(self.begin(self.stops, to * MM_PER_PULSE, speed, acceleration))

    def stop(self):
        with self.lock:
            self.stops += 1
            self.path.stop()
        self.braking = self.later(self.brake())

    def moving(self):
        with self.lock:
            return self.path.moving() or self.beginning

    def wait_for_stop(self):
        """Waits until the motor has obeyed the newest stop, within bounds."""
        if self.braking:
            concurrent.futures.wait([self.braking], timeout=STOP_MAX)

    def sample(self):
        with self.lock:
            moving, mm, stopping = self.path.moving(), self.path.now(), self.path.stopping
        if self.error:
            raise self.error
        if abs(self.newest["mm"] - mm) > TOLERANCE_MM:
            raise RuntimeError(f"the motor is at {self.newest['mm']:.3f} mm instead of {mm:.3f} mm")
        status = MOVING * moving + STOPPING * (moving and stopping) + HOME * (mm <= HOME_MM) + MOTOR_ON * self.on
        counts = round(self.newest["volts"] / self.cell["volts_per_count"])
        sample = {"c": counts, "p": round(mm / MM_PER_PULSE), "s": status}
        self.count += 1
        if self.count % 100 == 0:
            sample["v"] = [self.newest["temperature"]]
        return sample


if __name__ == "__main__":
    axis = OphydAxis()
    try:
        axis.run()
    finally:
        axis.wait_for_stop()
    os._exit(0)  # the axis stands; what ophyd-async still has to do takes longer than palpate waits
