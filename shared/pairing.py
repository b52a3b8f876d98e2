"""Who may talk: both sides prove that they know the pairing code, and neither says it.

    brick -> hello(version, role, nonce)      laptop -> challenge(nonce, salt)
    brick -> proof                            laptop -> welcome(proof)

This is authentication without secrecy: whoever can listen on the network can read the messages, but
cannot change them, nor add any: all that follows is signed (shared.signing). The proof is
HMAC-SHA256 (RFC 2104) over version, role and both nonces, so that an old one is worth nothing; the
keys of the signatures come from the same nonces. A code is short because people type it; PBKDF2
(RFC 8018) makes each guess from an overheard proof as dear as ITERATIONS, and a salt of its own
makes what was worked out for one pairing worth nothing for another.
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
"""Without 0 O 1 I L, which people take for each other."""

CODE_LENGTH, GROUP = 12, 4
"""Characters of a code, and of each group that people read: 59 bits."""

OLD_LENGTH = 8
"""Of codes that are no longer in use."""

ITERATIONS = 20000
"""Of PBKDF2, once per pairing; an estimated 0.9 s on the brick."""


class BadCode(ArmError, ValueError):
    """A text that cannot be a pairing code."""


class OldCode(BadCode):
    """A pairing code of an earlier version: too short."""


def new_code():
    # type: () -> str
    """A pairing code by the system's random generator."""
    letters = []  # type: List[str]
    while len(letters) < CODE_LENGTH:
        number = ord(os.urandom(1))
        if number < 256 // len(ALPHABET) * len(ALPHABET):  # or some letters would come more often
            letters.append(ALPHABET[number % len(ALPHABET)])
    return "".join(letters)


def read_code(text):
    # type: (str) -> str
    """The pairing code that a person typed; case, dashes and blanks do not matter.

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
    """The code as people read it, in groups."""
    return "-".join(code[at : at + GROUP] for at in range(0, CODE_LENGTH, GROUP))


@functools.lru_cache(maxsize=16)  # a program may pair often
def key_of(code, salt):
    # type: (str, str) -> bytes
    """The key for `proof`: 32 bytes.

    Args:
        code: as read_code returns it.
        salt: 32 hex digits, as the laptop has them for this code.
    """
    import hashlib  # not above: on the brick the arm is ready sooner without

    salted = b"BrickServo pairing " + salt.encode("ascii")
    return hashlib.pbkdf2_hmac("sha256", code.encode("ascii"), salted, ITERATIONS)


def new_nonce():
    # type: () -> str
    """32 hex digits that nobody has seen before."""
    return binascii.hexlify(os.urandom(16)).decode("ascii")


def proof(key, role, brick_nonce, laptop_nonce):
    # type: (bytes, str, str, str) -> str
    """What the side with this role sends to show that it has the key: 64 hex digits."""
    return _keyed(key, role, brick_nonce, laptop_nonce).hexdigest()


def is_proof(given, key, role, brick_nonce, laptop_nonce):
    # type: (str, bytes, str, str, str) -> bool
    """Whether `given` is that proof; takes the same time wherever the two differ."""
    import hmac

    return hmac.compare_digest(given, proof(key, role, brick_nonce, laptop_nonce))


def session_keys(key, brick_nonce, laptop_nonce):
    # type: (bytes, str, str) -> Tuple[bytes, ...]
    """The keys of one connection: what signs the brick's lines, and the laptop's; 32 bytes each."""
    session = _keyed(key, "session", brick_nonce, laptop_nonce).digest()
    return tuple(
        _keyed(session, role, brick_nonce, laptop_nonce).digest() for role in (BRICK, LAPTOP)
    )


def _keyed(key, what, brick_nonce, laptop_nonce):
    # type: (bytes, str, str, str) -> hmac.HMAC
    import hashlib
    import hmac

    text = "BrickServo {} {} {} {}".format(VERSION, what, brick_nonce, laptop_nonce)
    return hmac.new(key, text.encode("ascii"), hashlib.sha256)
