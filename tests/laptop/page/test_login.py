"""Tokens and the cookies that are made of them."""

import pytest

from laptop.page.login import Admission, LoginKey


def test_a_token_lets_one_browser_in_and_then_there_is_a_new_one():
    admission = Admission()
    renewals = []
    admission.on_renewal = lambda: renewals.append(admission.token)
    first = admission.token
    cookie = admission.redeem(first)
    assert admission.key.browser(cookie) == 1
    assert renewals == [admission.token]
    assert admission.token != first
    assert admission.redeem(first) == admission.redeem("") == admission.redeem("ä") == ""
    assert admission.key.browser(admission.redeem(admission.token)) == 2
    assert len(renewals) == 2


def test_a_cookie_tells_neither_token_nor_key_and_is_known_to_its_key_alone():
    admission = Admission()
    token = admission.token
    cookie = admission.redeem(token)
    assert token not in cookie
    assert admission.redeem(cookie) == ""
    assert LoginKey(b"another").browser(cookie) == 0
    assert LoginKey(b"same").browser(LoginKey(b"same").cookie(7)) == 7


@pytest.mark.parametrize("where", range(0, 80, 7))
def test_a_cookie_that_was_changed_is_nobodys(where):
    key = LoginKey(b"key")
    cookie = key.cookie(12)
    k = where % len(cookie)
    changed = cookie[:k] + ("1" if cookie[k] != "1" else "2") + cookie[k + 1 :]
    assert key.browser(changed) == 0
    for other in ("", ".", "12", "12.", cookie[1:], cookie[:-1], "x" + cookie, "ä.ö"):
        assert key.browser(other) == 0
