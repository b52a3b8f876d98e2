"""Mutual authentication: both sides prove that they know the pairing code; neither sends it.

    brick -> hello(version, role, nonce)      laptop -> challenge(nonce, salt)
    brick -> proof                            laptop -> welcome(proof)

This is authentication without secrecy: an eavesdropper can read the messages. It can neither change
them nor add any, as all later lines are signed (shared.signing). With || for joined texts:

    key     = PBKDF2-HMAC-SHA256(code, salt, ITERATIONS)          RFC 8018
    proof   = HMAC-SHA256(key, version || role || both nonces)    RFC 2104
    session = HMAC-SHA256(key, version || "session" || both nonces)
    signing key of a side = HMAC-SHA256(session, version || role || both nonces)

Each side chooses a fresh nonce, so a recorded proof is worth nothing in a later handshake. The role
in the text keeps a side's own proof from being sent back to it (reflection). A code is short, as
people type it; an eavesdropper can guess it offline, and PBKDF2 makes each guess cost ITERATIONS
hashes. The salt makes a table that was computed for one pairing useless for another. SPAKE2 would
prevent offline guesses, but is not in Python's standard library. TLS would encrypt, but `ssl` of
Python 3.5 knows no pre-shared keys, so people would have to handle certificates.
"""

import binascii
import functools
import os

from shared.arm_description import ArmError
from shared.messages import BRICK, LAPTOP, VERSION

MYPY = False
if MYPY:
    import hmac  # noqa: F401
    from typing import List, Tuple  # noqa: F401

ALPHABET = "23456789ABCDEFGHJKMNPQRSTUVWXYZ"
"""Characters of a code: digits and letters without 0 O 1 I L, which people confuse."""

CODE_LENGTH, GROUP = 12, 4
"""Length of a code, characters (59 bits), and of each group that people read."""

OLD_LENGTH = 8
"""Length of codes of earlier versions, characters."""

ITERATIONS = 20000
"""Iterations of PBKDF2, once per pairing; an estimated 0.9 s on the brick."""


class BadCode(ArmError, ValueError):
    """A text that cannot be a pairing code."""


class OldCode(BadCode):
    """A pairing code of an earlier version: too short."""


def new_code():
    # type: () -> str
    """Return a new pairing code from the system's random generator."""
    letters = []  # type: List[str]
    while len(letters) < CODE_LENGTH:
        number = ord(os.urandom(1))
        if number < 256 // len(ALPHABET) * len(ALPHABET):  # or some letters would come more often
            letters.append(ALPHABET[number % len(ALPHABET)])
    return "".join(letters)


def read_code(text):
    # type: (str) -> str
    """Return the pairing code that a person typed; case, dashes and blanks do not matter.

    Raises:
        OldCode: it is one of an earlier version.
        BadCode: it is too long, too short, or has other characters.
    """
    code = "".join(text.split()).replace("-", "").upper()
    if len(code) == OLD_LENGTH and set(code) <= set(ALPHABET):
        raise OldCode(
            "{} is a pairing code of an earlier version; codes have {} characters now: "
            "type the command that the tracker on the laptop prints".format(
                ascii(text)[:40], CODE_LENGTH
            )
        )
    if len(code) != CODE_LENGTH or not set(code) <= set(ALPHABET):
        raise BadCode(
            "{} is no pairing code: it has {} of the characters {}; "
            "the tracker on the laptop prints it".format(ascii(text)[:40], CODE_LENGTH, ALPHABET)
        )
    return code


def show_code(code):
    # type: (str) -> str
    """Return the code as people read it, in groups."""
    return "-".join(code[at : at + GROUP] for at in range(0, CODE_LENGTH, GROUP))


@functools.lru_cache(maxsize=16)  # a program may pair often
def key_of(code, salt):
    # type: (str, str) -> bytes
    """Derive the key for `proof` from a code by PBKDF2: 32 bytes.

    Args:
        code: as read_code returns it.
        salt: 32 hex digits, which the laptop chose with this code.
    """
    import hashlib  # not above: on the brick the arm is ready sooner without

    salted = b"BrickServo pairing " + salt.encode("ascii")
    return hashlib.pbkdf2_hmac("sha256", code.encode("ascii"), salted, ITERATIONS)


def new_nonce():
    # type: () -> str
    """Return 32 hex digits (128 bits) from the system's random generator."""
    return binascii.hexlify(os.urandom(16)).decode("ascii")


def proof(key, role, brick_nonce, laptop_nonce):
    # type: (bytes, str, str, str) -> str
    """Return the proof of the side with this role that it has the key: 64 hex digits."""
    return _keyed(key, role, brick_nonce, laptop_nonce).hexdigest()


def is_proof(given, key, role, brick_nonce, laptop_nonce):
    # type: (str, bytes, str, str, str) -> bool
    """Return whether `given` is that proof, in constant time (no timing attack)."""
    import hmac

    return hmac.compare_digest(given, proof(key, role, brick_nonce, laptop_nonce))


def session_keys(key, brick_nonce, laptop_nonce):
    # type: (bytes, str, str) -> Tuple[bytes, ...]
    """Return the session's keys for the brick's lines and the laptop's; 32 bytes each."""
    session_key = _keyed(key, "session", brick_nonce, laptop_nonce).digest()
    return tuple(
        _keyed(session_key, role, brick_nonce, laptop_nonce).digest() for role in (BRICK, LAPTOP)
    )


def _keyed(key, what, brick_nonce, laptop_nonce):
    # type: (bytes, str, str, str) -> hmac.HMAC
    import hashlib
    import hmac

    text = "BrickServo {} {} {} {}".format(VERSION, what, brick_nonce, laptop_nonce)
    return hmac.new(key, text.encode("ascii"), hashlib.sha256)
