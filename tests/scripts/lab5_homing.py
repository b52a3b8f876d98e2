#!/usr/bin/env python3
from ev3dev2.auto import *
import time

m = LargeMotor(OUTPUT_A)
m.stop_action = 'coast'
sound = Sound()


def stall_home(direction, timeout=20.0):
    """Turn slowly until the motor stalls; give the position back."""
    m.run_direct(duty_cycle_sp=direction * 25)
    start = time.monotonic()
    last, still = m.position, 0
    while still < 10:
        time.sleep(0.02)
        now = m.position
        still = still + 1 if now == last else 0
        last = now
        if time.monotonic() - start > timeout:
            m.stop()
            raise RuntimeError('no stop found')
    m.stop()
    return last


low = stall_home(-1)
high = stall_home(+1)
print('range', high - low)
m.run_forever(speed_sp=300)
while not m.is_stalled:
    time.sleep(0.01)
print('stalled', m.state)
m.off(brake=False)
sound.speak('done')
sound.play_tone(1000, 0.2)
display = Display()
display.text_pixels('range %d' % (high - low), x=10, y=20)
display.update()
Leds().all_off()
