"""What the server of a live view promises: who may connect, and that no client costs the run its time or its words."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path

import numpy as np
import pytest
from live_attack import LARGE
from live_client import NO_ROWS, PATIENCE, Client, PlainInputs, robot_view
from websockets.exceptions import ConnectionClosed, InvalidStatus

from twip.cli import main
from twip.errors import TwipError
from twip.lab.foxglove_protocol import WEB_APP
from twip.lab.live import LiveView
from twip.lab.live_link import END_LIMIT
from twip.lab.live_server import MOST_CLIENTS, MOST_QUEUED
from twip.lab.teleop import PUSH, SPEED

EVIL = "https://evil.example"
ATTACK = Path(__file__).with_name("live_attack.py")


@pytest.fixture
def said():
    """What the user is told."""
    return []


@pytest.fixture
def view(said):
    made = LiveView(
        [], {}, PlainInputs({PUSH: 0.0, SPEED: 0.0}), port=0, origins=["http://viewer.example:8080"], say=said.append
    )
    yield made
    made.close()


def told(view, said):
    """Wait until the user is told something."""
    end = time.monotonic() + PATIENCE
    while not said and time.monotonic() < end:
        view.write(*NO_ROWS)
        time.sleep(0.01)
    return said


def refused(view, **given):
    """Return the HTTP status with which a client is refused before the upgrade."""
    with pytest.raises(InvalidStatus) as error:
        Client(view, **given)
    return error.value.response.status_code


@pytest.mark.parametrize("origin", [None, WEB_APP, "file://", "http://viewer.example:8080"])
def test_programs_and_allowed_pages_steer(view, origin):
    with Client(view, origin=origin) as client:
        assert client.set([(PUSH, 2.0)]) == {PUSH: 2.0, SPEED: 0.0}


@pytest.mark.parametrize("origin", [EVIL, "null", "http://app.foxglove.dev", f"{WEB_APP}.evil.example", "file:///x"])
def test_a_page_of_another_origin_is_refused_before_the_upgrade(view, origin):
    assert refused(view, origin=origin) == 403


def test_the_user_is_told_once_of_refused_pages(view, said):
    for origin in (EVIL, "https://another.example"):
        assert refused(view, origin=origin) == 403
    assert told(view, said) == [
        f"a page of {EVIL} is not allowed to see or steer the run; --live-origin {EVIL} allows it"
    ]
    with Client(view) as client:
        client.set([(PUSH, 1.0)])  # what else there was to tell has arrived
    assert len(said) == 1


@pytest.mark.parametrize(
    ("origin", "page"),
    [("null", "a page without an origin of its own (a file, a frame)"), ("a b", "a page of a b")],
)
def test_no_origin_is_advised_that_the_option_does_not_take(view, said, origin, page):
    assert refused(view, origin=origin) == 403
    assert told(view, said) == [f"{page} is not allowed to see or steer the run"]


@pytest.mark.parametrize("subprotocol", ["foxglove.sdk.v1", "foxglove.websocket.v1"])
def test_newer_and_older_viewers_are_served(view, subprotocol):
    with Client(view, subprotocol=subprotocol) as client:
        assert client.socket.subprotocol == subprotocol
        assert client.info["capabilities"] == ["parameters", "parametersSubscribe"]


def test_a_client_of_another_protocol_is_refused(view):
    assert refused(view, subprotocol="chat") == 400


@pytest.mark.parametrize("origin", ["evil.example", "https://a.example/page", "https://a.example ", ""])
def test_what_is_no_origin_is_named(origin):
    with pytest.raises(TwipError, match="must be SCHEME://HOST"):
        LiveView([], {}, PlainInputs(), port=0, origins=[origin])


def test_an_origin_without_a_live_view_is_named(built, capsys):
    assert main(["run", str(built / "ssp" / "bench.ssp"), "--no-log", "--live-origin", EVIL]) == 1
    assert f"--live-origin {EVIL} needs --live" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("message", "why"),
    [
        ("{", "must be JSON"),
        ("[" * 100_000, "must be JSON"),
        ("9" * 5000, "must be JSON"),
        ("[]", "must be a JSON object"),
        ({}, "op must be one"),
        ({"op": "advertise", "channels": []}, "op must be one"),
        ({"op": "subscribe"}, "subscriptions must be an array"),
        ({"op": "subscribe", "subscriptions": [1]}, "subscriptions must be an array of objects"),
        ({"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]}, "id must be an integer"),
        ({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": True}]}, "channelId must be an integer"),
        ({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 99}]}, "there is no channel 99"),
        ({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}] * 2}, "is taken already"),
        ({"op": "unsubscribe", "subscriptionIds": ["1"]}, "id must be an integer"),
        ({"op": "getParameters", "parameterNames": [1]}, "parameterNames must be a string"),
        ({"op": "getParameters", "parameterNames": [], "id": 1}, "id must be a string"),
        ({"op": "setParameters", "parameters": [{"value": 1.0}]}, "name must be a string"),
        ({"op": "setParameters", "parameters": [{"name": PUSH}] * 23}, "at most 22 parameters"),
        (b"\1\0\0\0\0", "no binary messages"),
        (b"", "no binary messages"),
    ],
)
def test_what_is_not_understood_is_answered_and_the_client_stays(view, message, why):
    with Client(view) as client:
        client.socket.send(json.dumps(message) if isinstance(message, dict) else message)
        answer = client.hear()
        assert (answer["op"], answer["level"]) == ("status", 2)
        assert why in answer["message"]
        assert client.set([(SPEED, 0.25)]) == {PUSH: 0.0, SPEED: 0.25}


def test_messages_carry_the_number_of_their_subscription_until_it_ends():
    view, times, rows = robot_view(PlainInputs())
    with Client(view) as client:
        number = client.channels["/plant"]["id"]
        client.say(op="subscribe", subscriptions=[{"id": 4_000_000_000, "channelId": number}])
        client.subscribe("/left")
        view.write(times[:1], rows[:1])
        assert {client.hear()[0] for _ in range(2)} == {4_000_000_000, 1000 + client.channels["/left"]["id"]}
        client.say(op="unsubscribe", subscriptionIds=[4_000_000_000])
        client.say(op="getParameters", parameterNames=[], id="noted")
        assert client.hear()["id"] == "noted"
        view.write(times[100:101], rows[100:101])
        assert client.hear()[0] == 1000 + client.channels["/left"]["id"]
    view.close()


def test_parameters_are_told_to_those_who_watch_them(view):
    with Client(view) as watching, Client(view) as other:
        watching.say(op="subscribeParameterUpdates", parameterNames=[PUSH, "no.such"])
        watching.say(op="getParameters", parameterNames=[SPEED], id="1")
        assert watching.values() == {SPEED: 0.0}
        other.set([(SPEED, 0.5), (PUSH, 1.0)])
        assert watching.values() == {PUSH: 1.0}
        watching.say(op="unsubscribeParameterUpdates", parameterNames=[])
        watching.say(op="getParameters", parameterNames=[], id="2")
        watching.values()
        other.set([(PUSH, 3.0)])
        watching.say(op="getParameters", parameterNames=[], id="3")
        assert watching.hear() == {
            "op": "parameterValues",
            "parameters": [
                {"name": PUSH, "value": 3.0, "type": "float64"},
                {"name": SPEED, "value": 0.5, "type": "float64"},
            ],
            "id": "3",
        }


@pytest.mark.parametrize("kind", LARGE)
def test_a_large_message_ends_its_connection_only(view, kind):
    with Client(view) as other, Client(view) as hostile:
        with suppress(ConnectionClosed):
            hostile.socket.send(LARGE[kind])
        with pytest.raises(ConnectionClosed) as closed:
            hostile.hear()
        assert closed.value.sent is None or closed.value.sent.code == 1009
        assert hostile.socket.close_code in (1009, 1006)  # 1006: still sending when the connection was ended
        assert other.set([(PUSH, 1.0)])[PUSH] == 1.0


def attackers(view, times):
    """Return a process of hostile clients."""
    address = view.address.removeprefix("ws://").split(":")
    return subprocess.Popen([sys.executable, str(ATTACK), *address, str(times)], stderr=subprocess.DEVNULL)


def test_hostile_clients_cost_the_run_no_time_and_no_words(view, said, capfd):
    """They run in another process, so the time that this one takes is what they cost the run."""
    hostile, turns, before = attackers(view, 1), 0, time.process_time()
    while hostile.poll() is None:
        view.write(*NO_ROWS)
        time.sleep(0.01)
        turns += 1
    taken = time.process_time() - before
    assert hostile.returncode == 0
    assert turns > 10
    assert taken < 0.05 + 0.001 * turns  # of the 10 ms that a turn takes
    with Client(view) as client:
        assert client.set([(SPEED, 0.5)])[SPEED] == 0.5
    assert said == []
    assert capfd.readouterr() == ("", "")


def test_a_flood_of_values_reaches_the_run_one_message_at_a_time(view):
    with Client(view) as client:
        for number in range(5000):
            client.say(op="setParameters", parameters=[{"name": PUSH, "value": float(number)}])
        offered, offer = [], view._inputs.offer
        view._inputs.offer = lambda *one: offered.append(one) or offer(*one)
        for _ in range(20):
            before = len(offered)
            view.write(*NO_ROWS)
            assert len(offered) - before <= 1
            time.sleep(0.01)
        assert 1 <= len(offered) <= 20
        view.close()
        assert view._server._process.returncode == 0


def test_who_does_not_read_loses_the_oldest_messages_and_holds_nobody_up(view):
    text, longest = "x" * 40_000, 0.0
    count = 16 * MOST_QUEUED // len(text)  # more than sockets hold too
    with Client(view) as slow, Client(view) as other:
        slow.subscribe()
        other.subscribe()
        for number in range(count):
            begin = time.process_time()
            view.event(number / 1000.0, "info", "plant", text)
            longest = max(longest, time.process_time() - begin)
            assert other.hear()[1] == number * 1_000_000
        assert longest < 0.1
        heard = [slow.hear()[1] // 1_000_000]
        while heard[-1] < count - 1:
            heard.append(slow.hear()[1] // 1_000_000)
        assert heard == sorted(heard)
        assert heard[0] == 0
        assert len(heard) < count


def test_who_does_not_read_does_not_hold_up_the_end(view):
    with Client(view) as slow:
        slow.subscribe()
        for number in range(16 * MOST_QUEUED // 40_000):
            view.event(number / 1000.0, "info", "plant", "x" * 40_000)
            time.sleep(0.001)
        begin = time.monotonic()
        view.close()
        assert time.monotonic() - begin < END_LIMIT
        assert view._server._process.returncode == 0


def test_more_viewers_than_may_be_are_refused_until_one_goes(view):
    with ExitStack() as connected:
        for _ in range(MOST_CLIENTS):
            connected.enter_context(Client(view))
        assert refused(view) == 503
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        with suppress(InvalidStatus), Client(view):
            return
    pytest.fail("nobody was let in")


def test_without_its_server_the_run_goes_on_and_the_user_is_told_once(view, said):
    os.kill(view._server._process.pid, signal.SIGKILL)
    assert told(view, said) == ["the live view has ended: its server process is gone; the run goes on"]
    for k in range(10):
        view.write(*NO_ROWS)
        view.event(k, "info", "", "a word")
    assert len(said) == 1


def test_a_server_that_stands_still_holds_nobody_up(view):
    os.kill(view._server._process.pid, signal.SIGSTOP)
    try:
        begin = time.process_time()
        for k in range(1000):
            view.event(k / 1000.0, "info", "plant", "x" * 10_000)
        assert time.process_time() - begin < 2.0
        assert len(view._server._kept) <= 4 << 20
    finally:
        os.kill(view._server._process.pid, signal.SIGCONT)


def test_the_server_ends_with_the_run(view):
    process = view._server._process
    with Client(view) as client:
        view.event(0.0, "info", "plant", "the last word")
        view.close()
        assert process.returncode == 0
        with pytest.raises(ConnectionClosed) as closed:
            client.hear()
        assert closed.value.rcvd.code == 1001


@pytest.mark.heavy
def test_hostile_clients_make_no_delivery_late():
    """2 000 deliveries paced at 1 ms; a busy machine is late by itself, so the run's own time for each counts,
    and of the lateness the best of three rounds.
    """
    view, _, rows = robot_view(PlainInputs({PUSH: 0.0, SPEED: 0.0}))
    worst, latest = [], []
    for _ in range(3):
        hostile, spent, late = attackers(view, 1000), [], []
        begin = time.perf_counter()
        for k in range(2000):
            before = time.thread_time()
            view.write(np.array([k / 1000.0]), rows[:1])
            spent.append(time.thread_time() - before)
            due = begin + (k + 1) / 1000.0
            late.append(time.perf_counter() - due)
            time.sleep(max(0.0, -late[-1]))
        assert hostile.poll() is None
        hostile.kill()
        hostile.wait()
        worst.append(max(spent))
        latest.append(max(late))
    view.close()
    assert max(worst) < 0.01
    assert min(latest) < 0.03  # a server within this process was 118 ms late
