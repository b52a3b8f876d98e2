#!/usr/bin/env python3
"""PD loop at 50 Hz, set-points from a queue filled by a producer thread; Ctrl-C safe."""
import logging
import queue
import signal
import sys
import threading
from time import perf_counter, sleep

from ev3dev2.motor import LargeMotor, OUTPUT_B

logging.basicConfig(level=logging.INFO, format='%(levelname)s %(message)s', stream=sys.stdout)
log = logging.getLogger('pd')
stop = threading.Event()
signal.signal(signal.SIGTERM, lambda number, frame: stop.set())
targets = queue.Queue()


def produce():
    for target in (10, 20, 10, 0):
        targets.put(target)
        sleep(0.8)
    targets.put(None)


threading.Thread(target=produce, name='producer').start()
motor = LargeMotor(OUTPUT_B)
zero = motor.position
target, error_before = targets.get(), 0
tick, ticks = perf_counter(), 0
motor.run_direct(duty_cycle_sp=0)
try:
    while not stop.is_set():
        try:
            new = targets.get_nowait()
            if new is None:
                break
            log.info('at %d, next %d', motor.position - zero, new)
            target = new
        except queue.Empty:
            pass
        error = target - (motor.position - zero)
        duty = 2.0 * error + 0.4 * (error - error_before)
        motor.duty_cycle_sp = int(max(-60, min(60, duty)))
        error_before = error
        ticks += 1
        tick += 0.02
        sleep(max(0, tick - perf_counter()))
except KeyboardInterrupt:
    log.info('interrupted')
finally:
    motor.stop(stop_action='brake')
    log.info('stopped after %d ticks', ticks)
