#!/usr/bin/env python3
"""A motor in integers, moved by the controller on a chip: the host's side of LINE.md.

usage: python3 line_client.py PORT [BAUD]

Prints what the chip is, then a line a sample: number, register, code, error, state, and the
fault where one is latched. Exit status 0, or 1 with a sentence.
"""
import os
import secrets
import select
import struct
import sys
import termios
import time
import tty
import zlib

NONE = 2**32 - 1
GAINS = ("kp", "ki_dt", "kd_per_dt", "velocity_ff", "acceleration_ff", "friction_ff")
# The words of the settings that are not 0 where everything is off.
OFF = {f"{gain}_scale": 1 for gain in GAINS}
OFF.update(
    filter_scale=1, error_limit_counts=2**17, difference_limit_counts=2**18, counter_bits=32,
    largest_jump_counts=NONE, encoder_loss_codes=NONE, encoder_loss_samples=NONE,
    saturation_samples=NONE, dac_bits=12, slew_codes=2**24, integral_range_codes=2**20,
    difference_is_declared=1, load_counter_bits=32, load_largest_jump_counts=NONE,
    following_error_counts=NONE)
# Every word by its name, in the order of the line.
NAMES = """kp_mantissa kp_scale ki_dt_mantissa ki_dt_scale kd_per_dt_mantissa kd_per_dt_scale
derivative_of_measurement filter_smoothing filter_scale error_limit_counts
difference_limit_counts counter_bits largest_jump_counts feedback_of_load encoder_loss_codes
encoder_loss_samples saturation_samples dac_bits slew_codes quantiser dither_seed anti_windup
tracking integral_range_codes difference_is_declared velocity_ff_mantissa velocity_ff_scale
acceleration_ff_mantissa acceleration_ff_scale friction_ff_mantissa friction_ff_scale
ahead_limit_codes load_counter_bits load_largest_jump_counts following_error_counts lag_mantissa
lag_fraction_bits velocity_fraction_bits watches_ticks dead_band_counts hold_integral
half_gap_counts crossing_half_samples crossing_first_low crossing_first_high
flank_of_acceleration""".split()
SETTINGS = {name: OFF.get(name, 0) for name in NAMES}
# This axis: 2, 0.01 and 8 codes per count behind 12 bits, a counter of 16 bits, four checks.
SETTINGS.update(
    kp_mantissa=2**30, kp_scale=8, ki_dt_mantissa=42949673, kd_per_dt_mantissa=2**30,
    kd_per_dt_scale=32, anti_windup=1, counter_bits=16, largest_jump_counts=1000,
    following_error_counts=400, saturation_samples=50, watches_ticks=1)
# 10 counts a sample, across the end of the counter.
TABLE = [32_300 + 10 * k for k in range(101)]
STEPS = 200

STATES = ("disabled", "enabled", "moving", "holding", "fault")
CAUSES = ("emergency-stop", "hardware-bus", "missed-tick", "encoder-glitch", "encoder-loss",
          "setpoint-underrun", "following-error", "saturation-too-long")
NAKS = ("the frame came damaged", "the session is another", "the number is not {}",
        "there is no such request, or not now", "its configuration has CRC-32 {:08x}",
        "it refuses the word {} of the settings", "its memory is full",
        "it drives an axis of its own", "stretch {} of the plan does not go on")
HELLO, SETTINGS_KIND, MEMORY, BEGIN, STEP, STATUS = 0x01, 0x03, 0x04, 0x06, 0x07, 0x09
DISABLE, RESET, ENABLE, START = 1, 2, 4, 8


def encoded(body):
    """The frame of a body: CRC, COBS, end. It is too short for a block of 254 bytes."""
    pieces = (body + struct.pack("<I", zlib.crc32(body))).split(b"\0")
    return b"".join(bytes([len(piece) + 1]) + piece for piece in pieces) + b"\0"


def decoded(frame):
    """The body of a frame without its end; None if it is damaged."""
    pieces, at = [], 0
    while at < len(frame):
        pieces.append(frame[at + 1:at + frame[at]])
        at += frame[at]
    data = b"\0".join(pieces)
    whole = at == len(frame) and len(data) >= 4
    return data[:-4] if whole and data[-4:] == struct.pack("<I", zlib.crc32(data[:-4])) else None


class Chip:
    """A session with the chip at a port."""

    def __init__(self, port, baud=115_200):
        self.port = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self.port)
        mode = termios.tcgetattr(self.port)
        mode[4] = mode[5] = getattr(termios, f"B{baud}", None) or sys.exit(f"no speed is {baud}")
        termios.tcsetattr(self.port, termios.TCSAFLUSH, mode)
        self.patience_s = 0.05 + 2 * 198 * 10 / baud
        self.received, self.number, self.configuration, self.repeated = b"", 0, 0, 0
        self.session = 1 + secrets.randbelow(0xffff)
        told = self.ask(HELLO, numbered=False)
        if told[0] != 3:
            sys.exit(f"the chip speaks version {told[0]} of the line, this program version 3")
        _, name, self.image_crc, _, _, self.capacity, self.timer_hz = struct.unpack("<B8s5I", told)
        self.name = name.rstrip(b"\0").decode("ascii", "replace")

    def bodies(self, until):
        """The undamaged bodies that come, until that time."""
        while True:
            while b"\0" in self.received:
                frame, _, self.received = self.received.partition(b"\0")
                if (body := decoded(frame)) is not None and len(body) >= 7:
                    yield body
            left = until - time.monotonic()
            if left <= 0 or not select.select([self.port], [], [], left)[0]:
                return
            self.received += os.read(self.port, 256)

    def ask(self, kind, payload=b"", numbered=True):
        """Asks until there is an answer; its payload."""
        self.number += numbered
        head = struct.pack("<BHI", kind, self.session, self.number)
        patience, give_up = self.patience_s, max(3, 8 * self.patience_s)
        end = time.monotonic() + give_up
        while time.monotonic() < end:
            try:
                # The 0 ends whatever the line has made of what was before.
                os.write(self.port, b"\0" + encoded(head + payload))
            except BlockingIOError:
                pass  # Lost, as on any line.
            for body in self.bodies(time.monotonic() + patience):
                if body[0] == 0xff and body[7] == 0:
                    break  # Damaged: at once again.
                if body[1:7] == head[1:7]:
                    return self.told(body)
            else:
                patience = min(2 * patience, give_up / 4)
            self.repeated += 1
        sys.exit("the chip does not answer")

    def told(self, body):
        """The payload of an answer; a refusal ends the program."""
        if body[0] != 0xff:
            return body[7:]
        cause, value = struct.unpack("<BI", body[7:12])
        if cause == 5:
            value = list(SETTINGS)[value]
        text = NAKS[cause] if cause < len(NAKS) else f"cause {cause} with {{}}"
        sys.exit(f"the chip refuses request {self.number}: {text.format(value)}")

    def part(self, kind, payload):
        """A part of the configuration."""
        self.ask(kind, payload)
        self.configuration = zlib.crc32(bytes([kind]) + payload, self.configuration)

    def step(self, register, events=0):
        """One sample: code, error, state, and the fault as a text."""
        told = self.ask(STEP, struct.pack("<BI", events, register))
        code, error, state, flags, _ = struct.unpack("<iiBBI", told[:14])
        fault = ""
        if flags & 0x40:
            cause, tick, *_, measured, limit = struct.unpack("<BQ4i2q", told[14:])
            fault = f" {CAUSES[cause]} tick {tick} measured {measured} limit {limit}"
        return code, error, STATES[state], fault


def main(port, baud=115_200):
    """One motion of the table."""
    chip = Chip(port, int(baud))
    print(f"# {chip.name}, image {chip.image_crc:08x}, room for {chip.capacity} words")
    chip.part(SETTINGS_KIND, struct.pack(f"<{len(SETTINGS)}I", *SETTINGS.values()))
    for at in range(0, len(TABLE), 44):
        some = TABLE[at:at + 44]
        chip.part(MEMORY, struct.pack(f"<{len(some)}i", *some))
    chip.ask(BEGIN, struct.pack("<IBB", chip.configuration, ENABLE | START, 0))
    # A motor of first order, at rest where the table begins [2^-8 counts].
    place, speed = TABLE[0] << 8, 0
    for k in range(STEPS):
        register = (place >> 8) & 0xffff
        code, error, state, fault = chip.step(register, DISABLE if k == STEPS - 1 else 0)
        print(f"{k} {register} {code} {error} {state}{fault}")
        if fault:
            break
        speed += ((code << 4) - speed) >> 3
        place += speed
    stack_bytes, steps = struct.unpack("<II", chip.ask(STATUS, numbered=False))
    print(f"# {steps} samples, {stack_bytes} bytes of stack, asked again {chip.repeated} times")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    try:
        main(*sys.argv[1:])
    except (OSError, termios.error) as error:
        sys.exit(f"the port fails: {error}")
