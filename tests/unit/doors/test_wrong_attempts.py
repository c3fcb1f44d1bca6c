from foveacam_server.accounts.attempts import MOST_WRONG, WINDOW_S, WrongAttempts


class Watch:
    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def test_the_tenth_wrong_token_closes_the_address_for_a_minute() -> None:
    watch = Watch()
    attempts = WrongAttempts(watch)
    for _ in range(MOST_WRONG):
        assert attempts.wait_s("10.0.0.1") == 0.0
        attempts.add_wrong("10.0.0.1")
    assert attempts.wait_s("10.0.0.1") == WINDOW_S
    assert attempts.wait_s("10.0.0.2") == 0.0
    watch.now_s += WINDOW_S + 1.0
    assert attempts.wait_s("10.0.0.1") == 0.0


def test_wrong_tokens_that_are_far_apart_close_nothing() -> None:
    watch = Watch()
    attempts = WrongAttempts(watch)
    for _ in range(5 * MOST_WRONG):
        attempts.add_wrong("10.0.0.1")
        watch.now_s += 1.01 * WINDOW_S / MOST_WRONG
        assert attempts.wait_s("10.0.0.1") == 0.0


def test_many_addresses_do_not_fill_the_memory() -> None:
    attempts = WrongAttempts(Watch())
    for number in range(5000):
        attempts.add_wrong(str(number))
    assert len(attempts._wrong_s) <= 1024
