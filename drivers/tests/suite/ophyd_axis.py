"""The ophyd-async example with a motor of this file instead of ophyd-async: a stop is never followed by a motion.

Usage: ophyd_axis.py FOLDER, the folder of the example. Every order of events is forced by waiting for conditions, not for times.
"""
import asyncio
import contextlib
import sys
import threading
import time
import types


class Signal:
    """Takes a value when `gate` is open."""

    def __init__(self, value):
        self.value, self.listener, self.gate, self.is_waited_for = value, None, threading.Event(), threading.Event()
        self.gate.set()

    async def get_value(self):
        return self.value

    def subscribe(self, listener):
        self.listener = listener

    async def set(self, value):
        self.is_waited_for.set()
        while not self.gate.is_set():
            await asyncio.sleep(0.001)
        self.value = value


class Status:
    def __init__(self, coroutine):
        self.task = asyncio.ensure_future(coroutine)

    @property
    def done(self):
        return self.task.done()

    def __await__(self):
        return self.task.__await__()


class Motor:
    """As an EPICS motor record: `set` writes its target some turns of the loop after its call, and a stop ends what goes on then."""

    def __init__(self, name, instant):
        self.velocity, self.acceleration_time, self.user_readback = Signal(1.0), Signal(0.1), Signal(0.0)
        self.target, self.calls, self.stops = Signal(0.0), 0, 0
        self.is_running, self.is_failing = False, False

    def set(self, mm):
        self.calls += 1
        return Status(self.run(mm))

    async def run(self, mm):
        await self.target.set(mm)
        self.is_running = True
        while self.is_running:
            await asyncio.sleep(0.001)
        raise RuntimeError("stopped")

    async def stop(self, success):
        if self.is_failing:
            raise OSError("the motor does not answer")
        self.stops += 1
        self.is_running = False


@contextlib.asynccontextmanager
async def init_devices():
    yield


core = types.ModuleType("ophyd_async.core")
core.init_devices = init_devices
core.soft_signal_r_and_setter = lambda kind, value, units, name: (Signal(value), None)
sim = types.ModuleType("ophyd_async.sim")
sim.SimMotor = Motor
sys.modules.update({"ophyd_async": types.ModuleType("ophyd_async"), "ophyd_async.core": core, "ophyd_async.sim": sim})
sys.path.insert(0, sys.argv[1])
import ophyd_axis  # noqa: E402
from palpate_sidecar import Refused  # noqa: E402

ophyd_axis.TOLERANCE_MM = 1e9  # the motor here has no position


def until(what, is_so):
    end = time.monotonic() + 60
    while not is_so():
        assert time.monotonic() < end, f"never: {what}"
        time.sleep(0.001)


def axis():
    one = ophyd_axis.OphydAxis()
    one.enable()
    return one


def turns(one, count=200):
    """So many turns of the loop pass."""

    async def turn():
        for _ in range(count):
            await asyncio.sleep(0)

    one.later(turn()).result()


def a_stop_while_the_speed_is_set_is_followed_by_no_motion():
    for name in ("stop", "halt"):
        one = axis()
        one.motor.velocity.gate.clear()
        one.move(40_000, 5.0, 20.0)
        until("the speed is set", one.motor.velocity.is_waited_for.is_set)
        assert one.moving(), "a second motion is refused meanwhile"
        getattr(one, name)()
        until("the motor's own stop", lambda: one.motor.stops)
        one.motor.velocity.gate.set()
        until("the speed is taken", lambda: one.motor.velocity.value == 5.0)
        turns(one)
        assert one.motor.calls == 0 and not one.motor.is_running and not one.moving()
        assert one.path.now() == 0.0, "the reported position is that of the motor"
        # It can be moved after that.
        one.move(40_000, 5.0, 20.0)
        until("moved", lambda: one.motor.is_running)
        assert one.sample()["s"] & ophyd_axis.MOVING


def a_stop_before_the_target_is_written_is_repeated():
    one = axis()
    one.motor.target.gate.clear()
    one.move(40_000, 5.0, 20.0)
    until("the target is about to be written", one.motor.target.is_waited_for.is_set)
    one.stop()
    until("the first stop", lambda: one.motor.stops)
    one.motor.target.gate.set()
    one.wait_for_stop()
    assert one.braking.done() and not one.motor.is_running, "it runs on"
    assert one.error is None, one.error


def a_stop_reaches_the_motor_whatever_the_computed_path_does():
    one = axis()
    for count in (1, 2):
        one.stop()
        one.wait_for_stop()
        assert one.motor.stops == count
    # The computed path ends before the motor: 1 mm at 5 mm/s.
    one.move(1_000, 5.0, 20.0)
    until("moved", lambda: one.motor.is_running)
    until("the path's end", lambda: not one.path.moving())
    one.halt()
    one.wait_for_stop()
    assert not one.motor.is_running and one.error is None


def a_motor_that_cannot_be_stopped_is_a_fault():
    one = axis()
    one.move(40_000, 5.0, 20.0)
    until("moved", lambda: one.motor.is_running)
    one.motor.is_failing = True
    one.stop()
    one.wait_for_stop()
    try:
        one.sample()
    except OSError:
        return
    raise AssertionError("no fault")


def without_its_motor_it_refuses():
    one = ophyd_axis.OphydAxis()
    try:
        one.move(1, 1.0, 1.0)
    except Refused:
        return
    raise AssertionError("it moves")


for test in (
    a_stop_while_the_speed_is_set_is_followed_by_no_motion,
    a_stop_before_the_target_is_written_is_repeated,
    a_stop_reaches_the_motor_whatever_the_computed_path_does,
    a_motor_that_cannot_be_stopped_is_a_fault,
    without_its_motor_it_refuses,
):
    test()
    print(test.__name__.replace("_", " "))
