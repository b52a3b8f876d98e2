"""The pairing code: easily typed, hard to guess, never sent."""

import pytest

from shared import pairing
from shared.arm_description import ArmError
from shared.messages import BRICK, LAPTOP


def test_a_new_code_is_one_that_can_be_typed():
    codes = {pairing.new_code() for _ in range(200)}
    assert len(codes) == 200
    for code in codes:
        assert pairing.read_code(pairing.show_code(code)) == code
    assert set("".join(codes)) == set(pairing.ALPHABET)


@pytest.mark.parametrize("text", ["ABCD-EFGH", "abcdefgh", " ab-cd ef-gh\n", "a-b-c-d-e-f-g-h"])
def test_case_dashes_and_blanks_do_not_matter(text):
    assert pairing.read_code(text) == "ABCDEFGH"


@pytest.mark.parametrize(
    "text", ["", "ABCD", "ABCD-EFGH-J", "ABCD-EFG0", "\u0391BCDEFGH", "\ud800"]
)
def test_a_text_that_is_no_code_is_refused_in_one_line(text):
    with pytest.raises(pairing.BadCode) as error:
        pairing.read_code(text)
    assert isinstance(error.value, ArmError)
    assert "8 of the characters 23456789ABC" in str(error.value)
    assert str(error.value).isprintable()


def test_a_proof_holds_for_its_key_role_and_nonces_only():
    key = pairing.key_of("ABCDEFGH")
    given = (BRICK, "1" * 32, "2" * 32)
    right = pairing.proof(key, *given)
    assert pairing.is_proof(right, key, *given)
    assert not pairing.is_proof(right, pairing.key_of("ABCDEFGJ"), *given)
    assert not pairing.is_proof(right, key, LAPTOP, *given[1:])
    assert not pairing.is_proof(right, key, BRICK, "2" * 32, "1" * 32)
    assert not pairing.is_proof(right, key, BRICK, "1" * 32, "3" * 32)
    assert pairing.new_nonce() != pairing.new_nonce()


def test_the_proof_is_hmac_sha256_as_openssl_has_it():
    """Worked out with the openssl command: kdf PBKDF2, then dgst -sha256 -mac HMAC."""
    key = pairing.key_of("ABCDEFGH")
    assert key.hex() == "ed483fce58a1f0d7fa0b0a72884c237aa9f5aa577d71843887a7ab25825d63a0"
    assert (
        pairing.proof(key, BRICK, "1" * 32, "2" * 32)
        == "be4584161c0c08370dd5f17a8293349d3f77c5aaa563ec67a200229dc5750121"
    )
