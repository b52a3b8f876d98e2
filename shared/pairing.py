"""Who may talk: both sides prove that they know the pairing code, and neither says it.

    brick -> hello(version, role, nonce)      laptop -> challenge(nonce)
    brick -> proof                            laptop -> welcome(proof)

This is authentication without secrecy: whoever can listen on the network can read the messages,
and whoever can alter what passes there can take a connection over once it is proven. The proof is
HMAC-SHA256 (RFC 2104) over version, role and both nonces, so that an old one is worth nothing. A
code is short because people type it; PBKDF2 (RFC 8018) makes each guess from an overheard proof as
dear as ITERATIONS.
"""

import binascii
import functools
import os

from shared.arm_description import ArmError
from shared.messages import VERSION

ALPHABET = "23456789ABCDEFGHJKMNPQRSTUVWXYZ"
"""Without 0 O 1 I L, which people take for each other."""

CODE_LENGTH = 8

ITERATIONS = 10000
"""Of PBKDF2, once per program; an estimated third of a second on the brick."""


class BadCode(ArmError, ValueError):
    """A text that cannot be a pairing code."""


def new_code():
    """A pairing code by the system's random generator."""
    letters = []
    while len(letters) < CODE_LENGTH:
        number = ord(os.urandom(1))
        if number < 256 // len(ALPHABET) * len(ALPHABET):  # or some letters would come more often
            letters.append(ALPHABET[number % len(ALPHABET)])
    return "".join(letters)


def read_code(text):
    """The pairing code that a person typed; case, dashes and blanks do not matter.

    Raises:
        BadCode: it is too long, too short, or has other characters.
    """
    code = "".join(text.split()).replace("-", "").upper()
    if len(code) != CODE_LENGTH or not set(code) <= set(ALPHABET):
        raise BadCode(
            "{} is no pairing code: it has {} of the characters {}; "
            "the tracker on the laptop prints it".format(ascii(text)[:40], CODE_LENGTH, ALPHABET)
        )
    return code


def show_code(code):
    """The code as people read it, in two groups."""
    return code[: CODE_LENGTH // 2] + "-" + code[CODE_LENGTH // 2 :]


@functools.lru_cache(maxsize=16)  # a program may pair often
def key_of(code):
    """The key for `proof`: 32 bytes."""
    import hashlib  # not above: on the brick the arm is ready sooner without

    return hashlib.pbkdf2_hmac("sha256", code.encode("ascii"), b"BrickServo pairing", ITERATIONS)


def new_nonce():
    """32 hex digits that nobody has seen before."""
    return binascii.hexlify(os.urandom(16)).decode("ascii")


def proof(key, role, brick_nonce, laptop_nonce):
    """What the side with this role sends to show that it has the key: 64 hex digits."""
    import hashlib
    import hmac

    text = "BrickServo {} {} {} {}".format(VERSION, role, brick_nonce, laptop_nonce)
    return hmac.new(key, text.encode("ascii"), hashlib.sha256).hexdigest()


def is_proof(given, key, role, brick_nonce, laptop_nonce):
    """Whether `given` is that proof; takes the same time wherever the two differ."""
    import hmac

    return hmac.compare_digest(given, proof(key, role, brick_nonce, laptop_nonce))
