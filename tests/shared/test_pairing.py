"""The pairing code: easily typed, hard to guess, never sent."""

import pytest

from shared import pairing
from shared.arm_description import ArmError
from shared.messages import BRICK, LAPTOP

CODE = "ABCDEFGHJKMN"
SALT = "5a" * 16


def test_a_code_is_worth_fifty_bits_and_has_a_form_that_people_read():
    assert len(pairing.ALPHABET) ** pairing.CODE_LENGTH >= 2**50
    assert pairing.show_code(CODE) == "ABCD-EFGH-JKMN"


def test_a_code_of_an_earlier_version_is_told_apart():
    with pytest.raises(pairing.OldCode, match="of an earlier version; codes have 12 characters"):
        pairing.read_code("KS82-DNHF")


def test_a_new_code_is_one_that_can_be_typed():
    codes = {pairing.new_code() for _ in range(200)}
    assert len(codes) == 200
    for code in codes:
        assert pairing.read_code(pairing.show_code(code)) == code
    assert set("".join(codes)) == set(pairing.ALPHABET)


@pytest.mark.parametrize(
    "text", [CODE, "ABCD-EFGH-JKMN", "abcdefghjkmn", " ab-cd ef-gh jk mn\n", "a-b-c-d-e-f-g-h-jkmn"]
)
def test_case_dashes_and_blanks_do_not_matter(text):
    assert pairing.read_code(text) == CODE


@pytest.mark.parametrize(
    "text", ["", "ABCD", "ABCD-EFGH-J", "ABCD-EFGH-JKM0", "\u0391BCDEFGHJKMN", "\ud800"]
)
def test_a_text_that_is_no_code_is_refused_in_one_line(text):
    with pytest.raises(pairing.BadCode) as error:
        pairing.read_code(text)
    assert isinstance(error.value, ArmError)
    assert "12 of the characters 23456789ABC" in str(error.value)
    assert str(error.value).isprintable()


def test_a_proof_holds_for_its_key_role_and_nonces_only():
    key = pairing.key_of(CODE, SALT)
    given = (BRICK, "1" * 32, "2" * 32)
    right = pairing.proof(key, *given)
    assert pairing.is_proof(right, key, *given)
    assert not pairing.is_proof(right, pairing.key_of("ABCDEFGHJKMP", SALT), *given)
    assert not pairing.is_proof(right, pairing.key_of(CODE, "5b" * 16), *given)
    assert not pairing.is_proof(right, key, LAPTOP, *given[1:])
    assert not pairing.is_proof(right, key, BRICK, "2" * 32, "1" * 32)
    assert not pairing.is_proof(right, key, BRICK, "1" * 32, "3" * 32)
    assert pairing.new_nonce() != pairing.new_nonce()


def test_the_proof_is_hmac_sha256_as_openssl_has_it():
    """Worked out with the openssl command: kdf PBKDF2, then dgst -sha256 -mac HMAC."""
    key = pairing.key_of(CODE, SALT)
    assert key.hex() == "b859ae0f7bb6823c533813a9e8c6a5040d9ea8b993d67b2a32395e8b23e4e753"
    assert (
        pairing.proof(key, BRICK, "1" * 32, "2" * 32)
        == "af561d9a20cb04e06263d7f01d5cebc71ddcb338b42d5602a0f7e2e729ca3f53"
    )


def test_the_keys_of_a_connection_are_hmac_sha256_as_openssl_has_it():
    key = pairing.key_of(CODE, SALT)
    brick, laptop = pairing.session_keys(key, "1" * 32, "2" * 32)
    assert laptop.hex() == "2aec403196cf845cf6f014d123c1eade45b259b7260298b278e7c8d83006a191"
    assert len({brick, laptop, *pairing.session_keys(key, "1" * 32, "3" * 32)}) == 4
